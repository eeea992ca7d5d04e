// SPDX-License-Identifier: Apache-2.0
package obscura.client;

import java.io.IOException;
import java.nio.file.Files;
import java.nio.file.Path;
import java.security.GeneralSecurityException;
import java.util.HexFormat;
import javax.crypto.Mac;
import javax.crypto.spec.SecretKeySpec;

/** The token that a server wants of clients that come over a network; it is never sent, only a proof of it. */
final class Token {
    private static final int BYTES = 32;

    private final byte[] secret;

    /** Reads a token. Throws IllegalArgumentException for what is none. */
    Token(Path file) {
        try {
            secret = Files.readAllBytes(file);
        } catch (IOException error) {
            throw new IllegalArgumentException(file + ": cannot be read: " + error.getMessage(), error);
        }
        if (secret.length != BYTES)
            throw new IllegalArgumentException(file + ": a token of " + secret.length + " bytes, allowed " + BYTES);
    }

    /** HMAC-SHA256 of the challenge, in hexadecimal digits as it is. */
    String proof(String challenge) {
        try {
            Mac mac = Mac.getInstance("HmacSHA256");
            mac.init(new SecretKeySpec(secret, "HmacSHA256"));
            return HexFormat.of().formatHex(mac.doFinal(HexFormat.of().parseHex(challenge)));
        } catch (GeneralSecurityException error) {
            throw new IllegalStateException(error);
        }
    }
}
