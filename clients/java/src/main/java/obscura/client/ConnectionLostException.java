// SPDX-License-Identifier: Apache-2.0
package obscura.client;

/** The server is gone, cannot be reached, does not answer in time or does not speak the protocol. */
public final class ConnectionLostException extends ObscuraException {
    private static final long serialVersionUID = 1L;

    ConnectionLostException(String message) {
        super(message);
    }
}
