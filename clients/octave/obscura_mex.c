/* SPDX-License-Identifier: Apache-2.0 */
/* MEX function over libobscura-client for Octave and MATLAB, plain C. The .m files beside it are its
 * interface.
 *
 *   handle = obscura_mex('connect', ADDRESS, TIMEOUT_S, TOKEN_FILE)
 *   handle = obscura_mex('start', SCENE, ROOT, PROGRAM, THREADS, TIMEOUT_S)      empty: default
 *   [map, arrays] = obscura_mex('call', HANDLE, NAME, FIELDS)
 *   error = obscura_mex('error', HANDLE)                                         of the last call
 *   obscura_mex('close', HANDLE)
 *
 * Ctrl-C in Octave cancels a call at the server and keeps the connection. Errors have identifiers
 * obscura:CODE. */
#include "obscura_mex_values.h"

#include <mex.h>
#include <obscura_client.h>
#include <signal.h>
#include <stdio.h>
#include <string.h>

enum { MOST_CLIENTS = 64 };

static struct {
    obscura_client* client; /* NULL: free */
    double handle;
} clients[MOST_CLIENTS];
static double last_handle = 0;

static void close_all(void) {
    for (int i = 0; i < MOST_CLIENTS; ++i) {
        obscura_close(clients[i].client);
        clients[i].client = NULL;
    }
}

static int slot_of(const mxArray* handle) {
    const double wanted = mxIsDouble(handle) && mxGetNumberOfElements(handle) == 1 ? mxGetScalar(handle) : 0;
    for (int i = 0; i < MOST_CLIENTS; ++i)
        if (clients[i].client != NULL && clients[i].handle == wanted) return i;
    return -1;
}

static obscura_client* client_of(const mxArray* handle) {
    const int slot = slot_of(handle);
    if (slot < 0) mexErrMsgIdAndTxt("obscura:closed", "the connection is closed");
    return clients[slot].client;
}

/** Ends the function with the error: identifier obscura:CODE with underscores, message and hint. */
static void throw_error(const obscura_error* error) {
    char id[96], text[sizeof error->message + sizeof error->hint + 4];
    snprintf(id, sizeof id, "obscura:%s", error->code[0] == 0 ? "error" : error->code);
    for (char* c = id + 8; *c != 0; ++c)
        if (strchr("abcdefghijklmnopqrstuvwxyz0123456789", *c) == NULL) *c = '_';
    snprintf(text, sizeof text, error->hint[0] == 0 ? "%s" : "%s (%s)", error->message, error->hint);
    mexErrMsgIdAndTxt(id, "%s", text);
}

/** The text of an argument, to be freed with mxFree(); NULL if it is empty. */
static char* text_of(const mxArray* argument, const char* what) {
    if (mxIsEmpty(argument)) return NULL;
    char* text = mxIsChar(argument) ? mxArrayToString(argument) : NULL;
    if (text == NULL) mexErrMsgIdAndTxt("obscura:bad_use", "%s: a string is wanted", what);
    return text;
}

static mxArray* keep(obscura_client* client, const obscura_error* error) {
    if (client == NULL) throw_error(error);
    for (int i = 0; i < MOST_CLIENTS; ++i) {
        if (clients[i].client != NULL) continue;
        clients[i].client = client;
        clients[i].handle = ++last_handle;
        return mxCreateDoubleScalar(last_handle);
    }
    obscura_close(client);
    mexErrMsgIdAndTxt("obscura:bad_use", "%d connections are open already", (int)MOST_CLIENTS);
    return NULL;
}

static mxArray* run_connect(const mxArray* in[]) {
    char *address = text_of(in[0], "address"), *token_file = text_of(in[2], "token file");
    const obscura_connect_options options = {.timeout_s = mxGetScalar(in[1]), .token_file = token_file};
    obscura_error error;
    obscura_client* client = obscura_connect(address, &options, &error);
    mxFree(address);
    mxFree(token_file);
    return keep(client, &error);
}

static mxArray* run_start(const mxArray* in[]) {
    char *scene = text_of(in[0], "scene"), *root = text_of(in[1], "root"),
         *program = text_of(in[2], "program");
    const obscura_start_options options = {.scene = scene,
                                           .root = root,
                                           .program = program,
                                           .threads = (int)mxGetScalar(in[3]),
                                           .timeout_s = mxGetScalar(in[4])};
    obscura_error error;
    obscura_client* client = obscura_start(&options, &error);
    mxFree(scene);
    mxFree(root);
    mxFree(program);
    return keep(client, &error);
}

#ifdef HAVE_OCTAVE
/* Octave's own flag: it takes SIGINT in a thread of its own. It acts on the flag once the function has
 * returned. */
extern volatile sig_atomic_t octave_interrupt_state;

static int is_interrupted(void) {
    return octave_interrupt_state > 0;
}
#else
static int is_interrupted(void) { /* MATLAB has no way that is documented */
    return 0;
}
#endif

/** Waits for the answer; Ctrl-C cancels the request. */
static obscura_status wait_for_answer(obscura_client* client, obscura_answer** answer) {
    obscura_status status = OBSCURA_PENDING;
    for (int cancelled = 0; status == OBSCURA_PENDING; status = obscura_wait(client, 0.1, answer)) {
        if (cancelled || !is_interrupted()) continue;
        obscura_cancel(client);
        cancelled = 1;
    }
    return status;
}

static void run_call(int outputs, mxArray* out[], const mxArray* in[]) {
    obscura_client* client = client_of(in[0]);
    const char* why = NULL;
    obscura_value* fields = obscura_value_of(in[2], &why);
    if (why != NULL || obscura_type_of(fields) != OBSCURA_MAP) {
        obscura_value_free(fields);
        mexErrMsgIdAndTxt("obscura:bad_use", "%s", why != NULL ? why : "the fields of a call are a struct");
    }
    char* name = text_of(in[1], "name of the call");
    obscura_answer* answer = NULL;
    obscura_status status = obscura_begin(client, name == NULL ? "" : name, fields);
    if (status == OBSCURA_OK) status = wait_for_answer(client, &answer);
    mxFree(name);
    if (status != OBSCURA_OK) throw_error(obscura_last_error(client));
    out[0] = obscura_mx_of(obscura_answer_map(answer));
    if (outputs > 1) out[1] = obscura_mx_arrays(answer);
    obscura_answer_free(answer);
}

static mxArray* run_error(const mxArray* in[]) {
    const obscura_error* error = obscura_last_error(client_of(in[0]));
    static const char* names[] = {"code", "message", "field", "allowed", "hint"};
    const char* texts[] = {error->code, error->message, error->field, error->allowed, error->hint};
    mxArray* made = mxCreateStructMatrix(1, 1, 5, names);
    for (int i = 0; i < 5; ++i)
        mxSetField(made, 0, names[i], mxCreateString(texts[i]));
    return made;
}

void mexFunction(int outputs, mxArray* out[], int inputs, const mxArray* in[]) {
    static const struct {
        const char* name;
        int inputs;
    } actions[] = {{"connect", 3}, {"start", 5}, {"call", 3}, {"error", 1}, {"close", 1}};
    char name[16] = "";
    if (inputs > 0 && mxIsChar(in[0])) mxGetString(in[0], name, sizeof name);
    int action = 0;
    while (action < 5 && strcmp(actions[action].name, name) != 0)
        ++action;
    if (action == 5 || inputs != 1 + actions[action].inputs)
        mexErrMsgIdAndTxt("obscura:bad_use",
                          "obscura_mex: connect, start, call, error or close, and its arguments");
    mexAtExit(close_all);
    switch (action) {
    case 0:
        out[0] = run_connect(in + 1);
        break;
    case 1:
        out[0] = run_start(in + 1);
        break;
    case 2:
        run_call(outputs, out, in + 1);
        break;
    case 3:
        out[0] = run_error(in + 1);
        break;
    default: {
        const int slot = slot_of(in[1]);
        if (slot < 0) break;
        obscura_close(clients[slot].client);
        clients[slot].client = NULL;
    }
    }
}
