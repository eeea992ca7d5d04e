// SPDX-License-Identifier: Apache-2.0
package obscura.client;

import java.util.LinkedHashMap;
import java.util.Map;

/** Keys of scene files and their values. */
public final class Keys {
    private Keys() {}

    /**
     * A map of keys: {@code keys("width", 640, "boresight", List.of(0, 0, 1))}. The value null removes a key of the scene.
     *
     * @param namesAndValues names and values in turn; numbers, strings, booleans, lists, arrays, maps
     */
    public static Map<String, Object> keys(Object... namesAndValues) {
        if (namesAndValues.length % 2 != 0) throw new IllegalArgumentException("a key without a value");
        Map<String, Object> keys = new LinkedHashMap<>();
        for (int i = 0; i < namesAndValues.length; i += 2) {
            if (!(namesAndValues[i] instanceof String name))
                throw new IllegalArgumentException("the name of a key is a string, not " + namesAndValues[i]);
            keys.put(name, namesAndValues[i + 1]);
        }
        return keys;
    }
}
