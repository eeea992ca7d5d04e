/* SPDX-License-Identifier: Apache-2.0 */
#include "token.h"

#include "sha256.h"

#include <errno.h>
#include <stdio.h>
#include <string.h>

enum { TOKEN_BYTES = 32, BLOCK_BYTES = 64, DIGEST_BYTES = 32 };

/** Bytes of hexadecimal digits in lower case. 0: there are others. */
static int read_hex(const char* digits, unsigned char* bytes, size_t count) {
    static const char known[] = "0123456789abcdef";
    for (size_t i = 0; i < 2 * count; ++i) {
        const char* found = digits[i] == 0 ? NULL : strchr(known, digits[i]);
        if (found == NULL) return 0;
        const unsigned digit = (unsigned)(found - known);
        bytes[i / 2] = (unsigned char)(i % 2 == 0 ? digit << 4 : bytes[i / 2] | digit);
    }
    return digits[2 * count] == 0;
}

/** Digest of the key, padded with bytes `pad`, and the message. */
static void padded_digest(const unsigned char* key, unsigned char pad, const unsigned char* message,
                          size_t bytes, char hex[65]) {
    unsigned char block[BLOCK_BYTES];
    for (size_t i = 0; i < BLOCK_BYTES; ++i)
        block[i] = (unsigned char)((i < TOKEN_BYTES ? key[i] : 0) ^ pad);
    sha256 digest = sha256_begin();
    sha256_add(&digest, block, sizeof block);
    sha256_add(&digest, message, bytes);
    sha256_end(&digest, hex);
}

int oc_prove(const char* file, const char* challenge, char proof[65], char* why, size_t why_bytes) {
    unsigned char token[TOKEN_BYTES + 1], asked[DIGEST_BYTES], inner[DIGEST_BYTES];
    FILE* in = fopen(file, "rb");
    if (in == NULL) {
        snprintf(why, why_bytes, "%s: %s", file, strerror(errno));
        return 0;
    }
    const size_t bytes = fread(token, 1, sizeof token, in);
    fclose(in);
    if (bytes != TOKEN_BYTES) {
        snprintf(why, why_bytes, "%s: no token, which has 32 bytes", file);
        return 0;
    }
    if (challenge == NULL || !read_hex(challenge, asked, sizeof asked)) {
        snprintf(why, why_bytes, "the server's challenge is none");
        return 0;
    }
    /* HMAC (RFC 2104) of a key that is shorter than a block. */
    padded_digest(token, 0x36, asked, sizeof asked, proof);
    (void)read_hex(proof, inner, sizeof inner);
    padded_digest(token, 0x5C, inner, sizeof inner, proof);
    return 1;
}
