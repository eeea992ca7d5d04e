// SPDX-License-Identifier: Apache-2.0
package obscura.client;

import java.util.Map;

/** The server refused a request. The connection lives on, and the scene is as it was. */
public final class RequestException extends ObscuraException {
    private static final long serialVersionUID = 1L;

    private final String code;
    private final String plainMessage;
    private final String field;
    private final String allowed;
    private final String hint;

    RequestException(Map<String, Object> head) {
        super(text(head, "hint").isEmpty() ? text(head, "message") : text(head, "message") + " (" + text(head, "hint") + ")");
        code = text(head, "code");
        plainMessage = text(head, "message");
        field = text(head, "field");
        allowed = text(head, "allowed");
        hint = text(head, "hint");
    }

    /** Kind of the error: "bad-argument", "bad-scene", "cancelled", ... */
    public String code() {
        return code;
    }

    /** What is wrong, in one line; getMessage() has the hint as well. */
    public String message() {
        return plainMessage;
    }

    /** Which field of the request or key of the scene is wrong; empty if the server did not say. */
    public String field() {
        return field;
    }

    /** Values that are allowed there; empty if the server did not say. */
    public String allowed() {
        return allowed;
    }

    /** What to try; empty if the server did not say. */
    public String hint() {
        return hint;
    }

    private static String text(Map<String, Object> head, String name) {
        Object value = head.get(name);
        return value == null ? "" : value.toString();
    }
}
