/* SPDX-License-Identifier: Apache-2.0 */
/* Calls the functions of an S-function in Simulink's order: sizes, parameters, sample times, start, a
 * thousand steps, end. */
#include <math.h>

static void give_parameters(SimStruct* S, const double* sample_time, const double* size,
                            const double* samples, const double* wait_s) {
    const mxArray all[] = {{NULL, sample_time, 1}, {"", NULL, 0},   {"scene.toml", NULL, 0},
                           {"ball, box", NULL, 0}, {NULL, size, 2}, {NULL, samples, 1},
                           {NULL, wait_s, 1}};
    S->parameter_count = (int)(sizeof all / sizeof *all);
    memcpy(S->parameters, all, sizeof all);
}

static void give_memory(SimStruct* S) {
    for (int i = 0; i < S->inputs; ++i)
        S->input[i].signal = calloc((size_t)(S->input[i].rows * S->input[i].columns), sizeof(double));
    for (int i = 0; i < S->outputs; ++i)
        S->output[i].signal = calloc((size_t)(S->output[i].rows * S->output[i].columns),
                                     S->output[i].type == SS_SINGLE ? sizeof(float) : sizeof(double));
    S->work = S->work_memory;
}

static void take_memory(SimStruct* S) {
    for (int i = 0; i < S->inputs; ++i)
        free(S->input[i].signal);
    for (int i = 0; i < S->outputs; ++i)
        free(S->output[i].signal);
}

/** Ends the program with what is wrong. */
static void require(int good, const char* what, int step) {
    if (good) return;
    fprintf(stderr, "NOT OK - step %d: %s\n", step, what);
    exit(1);
}

/** Wrong parameters are refused before anything is begun. */
static void check_parameters(void) {
    const double good = 0.1, none = 0, large[] = {48, 20000}, size[] = {24, 32};
    const double* cases[][4] = {{&none, size, &good, &good},
                                {&good, large, &good, &good},
                                {&good, size, &none, &good},
                                {&good, size, &good, &none}};
    for (int i = 0; i < 4; ++i) {
        SimStruct S = {0};
        give_parameters(&S, cases[i][0], cases[i][1], cases[i][2], cases[i][3]);
        mdlInitializeSizes(&S);
        require(S.error != NULL, "wrong parameters were taken", i);
        mdlTerminate(&S);
    }
    SimStruct S = {.parameter_count = 2};
    mdlInitializeSizes(&S);
    require(S.inputs == 0, "missing parameters were taken", 0);
}

int main(void) {
    check_parameters();
    const double sample_time = 0.1, size[] = {24, 32}, samples = 1, wait_s = 60;
    SimStruct S = {0};
    give_parameters(&S, &sample_time, size, &samples, &wait_s);
    mdlInitializeSizes(&S);
    require(S.error == NULL && S.inputs == 2 && S.outputs == 3 && S.work_count == 1, "sizes", 0);
    require(S.input[1].rows == 7 && S.input[1].columns == 3 && S.output[0].rows == 24 &&
                S.output[0].columns == 32,
            "ports", 0);
    mdlCheckParameters(&S);
    mdlInitializeSampleTimes(&S);
    require(S.sample_time == 0.1, "sample time", 0);
    give_memory(&S);
    mdlStart(&S);
    require(S.error == NULL, S.error, 0);

    double *time_s = S.input[0].signal, *poses = S.input[1].signal, *truth = S.output[1].signal,
           *flags = S.output[2].signal;
    const float* picture = S.output[0].signal;
    poses[3] = poses[7 + 3] = poses[14 + 3] = 1;
    poses[14] = -3;
    poses[14 + 2] = 12;
    for (int step = 0; step < 1000; ++step) {
        *time_s = 0.1 * step;
        poses[7] = 0.001 * step; /* the ball drifts along x, which columns count */
        poses[7 + 2] = 10;
        mdlOutputs(&S, 0);
        require(flags[0] == 0 && flags[1] == 0 && flags[2] == step + 1 && flags[3] == 0, "flags", step);
        require(truth[11] == poses[7] && truth[11 + 2] == 10 && truth[22] == -3, "truth", step);
        require(fabs(truth[11 + 9] - (15.5 + 32 * poses[7] / 10)) < 1e-6, "column of the ball in the truth",
                step);
        int lit = 0;
        for (int row = 0; row < 24; ++row) /* the column in which the ball's centre is */
            lit += picture[row + 24 * (int)(truth[11 + 9] + 0.5)] > 0;
        require(lit >= 5 && picture[0] == 0, "light of the ball", step);
    }
    mdlTerminate(&S);
    require(ssGetPWorkValue(&S, 0) == NULL, "the block still has its memory", 1000);
    take_memory(&S);
    puts("ok - a thousand steps");
    return 0;
}
