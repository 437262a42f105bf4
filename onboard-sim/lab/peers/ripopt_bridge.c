/* A compiled CasADi problem behind ripopt's C interface: ripopt's callbacks, answered by the functions that IPOPT gets.
 *
 * `struct problem` is filled in by ripopt_solver.py, which knows the functions' places and sparsities. */

#include <stddef.h>

typedef long long casadi_int;
typedef int (*casadi_function)(const double **arg, double **res, casadi_int *iw, double *w, int mem);

/* A function and its working memory. `out`: which of its results is asked for; the others are not computed. */
struct function {
    casadi_function call;
    const double **arg;
    double **res;
    casadi_int *iw;
    double *w;
    int out;
};

struct problem {
    struct function f, grad_f, g, jac_g, hess_l;
    const double *parameter;
    /* Row and column of each nonzero; of the Hessian's, in its lower triangle. */
    const int *jac_row, *jac_col, *hess_row, *hess_col;
};

static int ask(const struct function *function, double *into) {
    function->res[function->out] = into;
    return function->call(function->arg, function->res, function->iw, function->w, 0) == 0;
}

static int ask_at(const struct problem *problem, const struct function *function, const double *x, double *into) {
    function->arg[0] = x;
    function->arg[1] = problem->parameter;
    return ask(function, into);
}

static void copy(const int *from, int *into, int count) {
    for (int i = 0; i < count; i++) into[i] = from[i];
}

int bridge_f(int n, const double *x, int new_x, double *value, void *data) {
    (void)n, (void)new_x;
    const struct problem *problem = data;
    return ask_at(problem, &problem->f, x, value);
}

int bridge_grad_f(int n, const double *x, int new_x, double *gradient, void *data) {
    (void)n, (void)new_x;
    const struct problem *problem = data;
    return ask_at(problem, &problem->grad_f, x, gradient);
}

int bridge_g(int n, const double *x, int new_x, int m, double *values, void *data) {
    (void)n, (void)new_x, (void)m;
    const struct problem *problem = data;
    return ask_at(problem, &problem->g, x, values);
}

int bridge_jac_g(int n, const double *x, int new_x, int m, int nonzeros, int *row, int *col, double *values, void *data) {
    (void)n, (void)new_x, (void)m;
    const struct problem *problem = data;
    if (values == NULL) {
        copy(problem->jac_row, row, nonzeros);
        copy(problem->jac_col, col, nonzeros);
        return 1;
    }
    return ask_at(problem, &problem->jac_g, x, values);
}

int bridge_hess_l(int n, const double *x, int new_x, double factor, int m, const double *lambda, int new_lambda,
                  int nonzeros, int *row, int *col, double *values, void *data) {
    (void)n, (void)new_x, (void)m, (void)new_lambda;
    const struct problem *problem = data;
    if (values == NULL) {
        copy(problem->hess_row, row, nonzeros);
        copy(problem->hess_col, col, nonzeros);
        return 1;
    }
    const struct function *function = &problem->hess_l;
    function->arg[2] = &factor;
    function->arg[3] = lambda;
    return ask_at(problem, function, x, values);
}
