// SPDX-License-Identifier: Apache-2.0
package obscura.client;

import java.util.ArrayList;
import java.util.Collections;
import java.util.LinkedHashMap;
import java.util.List;
import java.util.Map;

/**
 * A request of one kind; the classes of obscura.client.calls are made from the server's own table of calls.
 *
 * @param <R> what its answer holds
 */
public abstract class Call<R> {
    /** Fields that are set; the server has defaults for the others. */
    protected final Map<String, Object> fields = new LinkedHashMap<>();

    private final String name;

    /** A call by its name: "render". */
    protected Call(String name) {
        this.name = name;
    }

    /** Name of the call. */
    public final String name() {
        return name;
    }

    /** Fields that are set. */
    public final Map<String, Object> fields() {
        return Collections.unmodifiableMap(fields);
    }

    /** Reads the head of the answer. */
    public abstract R read(Map<String, Object> head);

    /** A member of a head as a number; null stays null. */
    protected static Double number(Object value) {
        return value == null ? null : ((Number) value).doubleValue();
    }

    /** A member of a head as a list of numbers. */
    protected static List<Double> numbers(Object value) {
        if (value == null) return null;
        List<Double> numbers = new ArrayList<>();
        for (Object each : (List<?>) value) numbers.add(number(each));
        return numbers;
    }

    /** A member of a head as a list of strings. */
    @SuppressWarnings("unchecked")
    protected static List<String> strings(Object value) {
        return (List<String>) value;
    }

    /** A member of a head as a list. */
    @SuppressWarnings("unchecked")
    protected static List<Object> list(Object value) {
        return (List<Object>) value;
    }

    /** A member of a head as a map. */
    @SuppressWarnings("unchecked")
    protected static Map<String, Object> map(Object value) {
        return (Map<String, Object>) value;
    }

    /** A member of a head as a list of maps. */
    @SuppressWarnings("unchecked")
    protected static List<Map<String, Object>> maps(Object value) {
        return (List<Map<String, Object>>) value;
    }
}
