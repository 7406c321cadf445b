// test_sha256.c - the published vectors of FIPS 180-2, and files.
#include "tests/test.h"

#include "core/sha256.h"

TEST(the_published_vectors)
{
    static const struct {
        const char *text, *hex;
    } known[] = {
        {"", "e3b0c44298fc1c149afbf4c8996fb92427ae41e4649b934ca495991b7852b855"},
        {"abc", "ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad"},
        {"abcdbcdecdefdefgefghfghighijhijkijkljklmklmnlmnomnopnopq",
         "248d6a61d20638b8e5c026930c3e6039a33ce45964ff2167f6ecedd419db06c1"},
    };
    for (size_t k = 0; k < sizeof known / sizeof *known; k++) {
        char hex[SHA256_TEXT];
        sha256_of(known[k].text, strlen(known[k].text), hex);
        assert_string_equal(hex, known[k].hex);
    }
}

TEST(a_file_has_the_sum_of_its_bytes_and_a_missing_one_is_named)
{
    char hex[SHA256_TEXT] = "untouched";
    struct err e = {0};
    assert_false(sha256_file("/no/such", hex, &e));
    assert_string_equal(e.msg, "/no/such: No such file or directory");
    assert_int_equal(e.code, ERR_FILE);
    assert_string_equal(hex, "untouched");
    FILE *f = fopen("test_sha256.tmp", "w");
    fputs("abc", f);
    fclose(f);
    assert_true(sha256_file("test_sha256.tmp", hex, &e));
    unlink("test_sha256.tmp");
    assert_string_equal(hex, "ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad");
}

TEST_MAIN(cmocka_unit_test(the_published_vectors),
          cmocka_unit_test(a_file_has_the_sum_of_its_bytes_and_a_missing_one_is_named))
