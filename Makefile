# A thin face over CMake: every target installs the Debian packages that it misses.
BUILD := build
JOBS := $(shell nproc)

all: release

deps:
	@tools/deps.sh

release: deps
	@cmake --preset release -G Ninja $(if $(VERBOSE),,--log-level=WARNING) >/dev/null
	@cmake --build $(BUILD) -j $(JOBS)

dev: deps
	@cmake --preset dev -G Ninja --log-level=WARNING >/dev/null
	@cmake --build build-dev -j $(JOBS)

demo: release
	@$(BUILD)/bin/nacre demo

gallery: release
	@$(BUILD)/bin/nacre gallery

# Every quick test on the release build, and once more under the sanitizers. check-slow: the long ones.
check: release dev
	@ctest --test-dir $(BUILD) --output-on-failure -j $(JOBS) -LE slow
	@ctest --test-dir build-dev --output-on-failure -j $(JOBS) -LE slow

# The drivers of real devices, on devices that the kernel of an emulated machine acts.
check-vm: release
	@cmake --build $(BUILD) --target check-vm

# Debian packages into build-deb/; check-deb installs them in a fresh Debian in a folder, and removes them (as root).
deb: deps
	@tools/deb.sh

check-deb: deb
	@tools/check_deb.sh build-deb

# Time against error of every stage: bench-out/bench.html. QUICK=1: under two minutes.
bench: release
	@$(BUILD)/bin/nacre bench $(if $(QUICK),--quick) -o bench-out

# Twelve simulated samples by Snakemake 7, on this machine; ends with "Error 6" when some are not done.
library: release
	@tools/deps.sh --library
	@workflows/run workflows/library.yaml library-out

# The same on a real Slurm, controller and two nodes on this machine, as root; the same bytes.
check-cluster:
	@tools/deps.sh --cluster || { echo "check-cluster: skipped: its packages cannot be had"; exit 0; }; \
	 $(MAKE) --no-print-directory library && workflows/slurm/check library-out cluster-out

# What some benchmarks compare with where it is installed; nacre itself never needs it.
bench-peers:
	@if [ $$(id -u) = 0 ]; then apt-get install -y python3-skimage; else sudo apt-get install -y python3-skimage; fi

format: deps
	@git ls-files '*.c' '*.h' '*.cpp' | xargs clang-format -i

clean:
	@rm -rf build build-dev build-tsan build-deb demo-out gallery-out library-out cluster-out

.PHONY: all deps release dev demo gallery library check check-cluster check-vm deb check-deb bench bench-peers format clean
