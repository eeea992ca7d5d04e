// SPDX-License-Identifier: Apache-2.0
package obscura.client;

/** Told how far a request is, up to five times a second, by the thread that waits for its answer. */
@FunctionalInterface
public interface ProgressListener {
    /**
     * Called while the request is in progress; what it throws cancels the request and reaches the caller.
     *
     * @param done parts that are done: rows of a picture
     * @param total parts in all
     * @param leftSeconds time that is left, NaN while it is not known
     */
    void progress(long done, long total, double leftSeconds);
}
