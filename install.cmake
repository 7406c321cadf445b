# Where things go on a machine; debian/ makes packages of them.
include(GNUInstallDirs)

install(TARGETS nacre nacred nacre-lights)
if(TARGET nacre-view)
    install(TARGETS nacre-view)
endif()
install(DIRECTORY rigs DESTINATION ${CMAKE_INSTALL_DATADIR}/nacre)
install(DIRECTORY docs/ DESTINATION ${CMAKE_INSTALL_DOCDIR} PATTERN man EXCLUDE)
install(FILES README.md CHANGELOG.md DESTINATION ${CMAKE_INSTALL_DOCDIR})

# Manual pages and completion say what the option tables say.
set(pages ${CMAKE_BINARY_DIR}/pages)
add_custom_command(OUTPUT ${pages}/made
    COMMAND ${CMAKE_COMMAND} -DNACRE=$<TARGET_FILE:nacre>
            $<$<TARGET_EXISTS:nacre-view>:-DVIEW=${CMAKE_RUNTIME_OUTPUT_DIRECTORY}/nacre-view> -DOUT=${pages}
            -P ${CMAKE_SOURCE_DIR}/tools/pages.cmake
    DEPENDS nacre $<$<TARGET_EXISTS:nacre-view>:nacre-view> ${CMAKE_SOURCE_DIR}/tools/pages.cmake
    VERBATIM COMMAND_EXPAND_LISTS)
add_custom_target(pages DEPENDS ${pages}/made) # not of every build: `make deb` and the install ask for it
install(CODE "execute_process(COMMAND \"${CMAKE_COMMAND}\" --build \"${CMAKE_BINARY_DIR}\" --target pages COMMAND_ERROR_IS_FATAL ANY)")
install(DIRECTORY ${pages}/man1 docs/man/man8 DESTINATION ${CMAKE_INSTALL_MANDIR})
install(DIRECTORY ${pages}/completions/ DESTINATION ${CMAKE_INSTALL_DATADIR}/bash-completion/completions)

install(FILES acquire/systemd/nacred.service acquire/systemd/nacred.socket DESTINATION lib/systemd/system)
install(FILES acquire/systemd/nacre.sysusers DESTINATION lib/sysusers.d RENAME nacre.conf)
install(FILES acquire/udev/70-nacre.rules DESTINATION lib/udev/rules.d)
install(FILES ui/nacre-view.desktop DESTINATION ${CMAKE_INSTALL_DATADIR}/applications)
install(FILES acquire/udev/nacred.metainfo.xml DESTINATION ${CMAKE_INSTALL_DATADIR}/metainfo)
