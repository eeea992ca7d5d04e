// SPDX-License-Identifier: Apache-2.0
package obscura.client;

import java.util.List;
import java.util.Map;

/**
 * Answer of a request.
 *
 * @param head its fields
 * @param arrays its arrays, views of one buffer
 */
public record Answer(Map<String, Object> head, List<DataArray> arrays) {}
