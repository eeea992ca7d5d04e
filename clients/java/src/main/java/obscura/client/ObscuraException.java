// SPDX-License-Identifier: Apache-2.0
package obscura.client;

/** Base of all errors of this package. */
public class ObscuraException extends RuntimeException {
    private static final long serialVersionUID = 1L;

    ObscuraException(String message) {
        super(message);
    }
}
