// test_words.c - command lines come apart again as the words that they were made of.
#include "tests/test.h"

#include "ui/words.h"
#include <wordexp.h>

TEST(quoted_words_survive_a_shell)
{
    static const struct {
        const char *word, *quoted;
    } cases[] = {
        {"530nm", "530nm"},
        {"a/b-c_1.exr", "a/b-c_1.exr"},
        {"my folder", "'my folder'"},
        {"", "''"},
        {"it's", "'it'\\''s'"},
        {"*.jpg", "'*.jpg'"},
        {"$(ls) `ls`", "'$(ls) `ls`'"},
        {"a;b|c&d", "'a;b|c&d'"},
    };
    for (size_t k = 0; k < sizeof cases / sizeof *cases; k++) {
        char *quoted = words_quote(cases[k].word);
        assert_string_equal(quoted, cases[k].quoted);
        wordexp_t back;
        assert_int_equal(wordexp(quoted, &back, WRDE_NOCMD), 0);
        assert_int_equal(back.we_wordc, 1);
        assert_string_equal(back.we_wordv[0], cases[k].word);
        wordfree(&back);
        free(quoted);
    }
}

TEST(places_in_a_line_take_words_with_blanks)
{
    char *line = words_expand("hdr @/session -o %.exr", "my out", "rad");
    assert_string_equal(line, "hdr 'my out'/session -o rad.exr");
    wordexp_t words;
    assert_int_equal(wordexp(line, &words, WRDE_NOCMD), 0);
    assert_int_equal(words.we_wordc, 4);
    assert_string_equal(words.we_wordv[1], "my out/session");
    wordfree(&words);
    free(line);
}

TEST_MAIN(cmocka_unit_test(quoted_words_survive_a_shell),
          cmocka_unit_test(places_in_a_line_take_words_with_blanks))
