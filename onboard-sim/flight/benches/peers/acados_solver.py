"""acados on the landing problem, behind the interface of `solvers.Public`.

The interface and the libraries are those of the installation in ACADOS_SOURCE_DIR, or else of the wheel
`comma-deps-acados`. Dynamics are discrete (the same RK4 step as everybody's), Hessians exact. One solver for each length of
the horizon, all from one generated program. The end height is either a hard condition or priced as ours: 1000 a metre.
"""

import contextlib
import ctypes
import importlib.metadata
import os
import sys
import time

import casadi as ca
import numpy as np

import landing
import rollout
import solvers

PRICE = 1000.0
# Curvature of the price where the QP wants some, cost units per square metre; smaller ones fail more often.
PRICE_CURVATURE = 10.0
X, Z = 0, 1


def installed():
    """Makes acados importable; the words for its version."""
    source = os.environ.get("ACADOS_SOURCE_DIR")
    if source:
        sys.path.insert(0, os.path.join(source, "interfaces", "acados_template"))
        return f"the installation in {source}"
    import acados  # the wheel

    # Its libraries do not find each other by themselves.
    for library in ("libblasfeo.so", "libqpOASES_e.so.3.1", "libhpipm.so", "libacados.so"):
        ctypes.CDLL(os.path.join(acados.LIB_DIR, library), mode=ctypes.RTLD_GLOBAL)

    version = importlib.metadata.version("comma-deps-acados")
    os.environ["ACADOS_SOURCE_DIR"] = acados.DIR
    os.environ["ACADOS_PYTHON_INTERFACE_PATH"] = acados.TEMPLATE_DIR
    os.environ["TERA_PATH"] = acados.TERA_PATH
    sys.path.insert(0, os.path.dirname(acados.TEMPLATE_DIR))
    return f"the wheel comma-deps-acados {version}"


@contextlib.contextmanager
def silent(folder):
    """acados writes into the working directory and, as C does, past Python's standard output."""
    before, saved = os.getcwd(), os.dup(1)
    os.chdir(folder)
    sys.stdout.flush()
    nothing = os.open(os.devnull, os.O_WRONLY)
    os.dup2(nothing, 1)
    try:
        yield
    finally:
        os.dup2(saved, 1)
        os.close(saved)
        os.close(nothing)
        os.chdir(before)


def problem(priced):
    """The landing as acados takes it."""
    from acados_template import AcadosModel, AcadosOcp

    ocp, model = AcadosOcp(), AcadosModel()
    state, gimbal = ca.SX.sym("x", 6), ca.SX.sym("u")
    model.name = "landing_priced" if priced else "landing_hard"
    model.x, model.u, model.p = state, gimbal, ca.SX.sym("p", 0)
    model.disc_dyn_expr = landing.STEP(state, gimbal)
    ocp.model = model
    ocp.dims.N = landing.HORIZON
    weights, target = np.diag(landing.STATE_WEIGHTS), landing.TARGET
    cost = ocp.cost
    cost.cost_type_0 = cost.cost_type = cost.cost_type_e = "LINEAR_LS"
    # The start costs nothing, the end costs a whole step: a sum over the ends of the intervals.
    cost.W_0, cost.Vx_0, cost.Vu_0 = np.array([[landing.INPUT_WEIGHT]]), np.zeros((1, 6)), np.ones((1, 1))
    cost.yref_0 = np.zeros(1)
    cost.W = np.block([[weights, np.zeros((6, 1))], [np.zeros((1, 6)), landing.INPUT_WEIGHT]])
    cost.Vx, cost.Vu = np.eye(7, 6), np.eye(7, 1, -6)
    cost.yref = np.append(target, 0.0)
    cost.W_e, cost.Vx_e, cost.yref_e = landing.STEP_S * weights, np.eye(6), target
    limits = ocp.constraints
    limits.x0 = np.array([0.0, 15.0, np.pi / 2.0, -5.0, 0.0, 0.0])
    limits.idxbu = np.array([0])
    limits.lbu, limits.ubu = np.array([-landing.GIMBAL_LIMIT_RAD]), np.array([landing.GIMBAL_LIMIT_RAD])
    limits.idxbx_e = np.array([X, Z])
    limits.lbx_e, limits.ubx_e = np.array([-landing.X_FINAL_M, 0.0]), np.array([landing.X_FINAL_M, 0.0])
    if priced:
        limits.idxsbx_e = np.array([1])
        cost.zl_e = cost.zu_e = np.array([PRICE])
        cost.Zl_e = cost.Zu_e = np.array([PRICE_CURVATURE])
    options = ocp.solver_options
    options.tf = landing.HORIZON * landing.STEP_S
    options.integrator_type = "DISCRETE"
    options.nlp_solver_type = "SQP"
    options.hessian_approx = "EXACT"
    options.regularize_method = "CONVEXIFY"
    options.qp_solver = "PARTIAL_CONDENSING_HPIPM"
    options.qp_solver_cond_N = 5
    options.globalization = os.environ.get("ACADOS_GLOBALIZATION", "MERIT_BACKTRACKING")
    options.nlp_solver_max_iter = solvers.MOST_ITERATIONS
    options.qp_solver_iter_max = 100
    options.qp_solver_warm_start = 0
    for tolerance in ("stat", "eq", "ineq", "comp"):
        setattr(options, f"nlp_solver_tol_{tolerance}", landing.TOLERANCE)
    options.print_level = 0
    options.ext_fun_compile_flags = "-O3 -march=native"
    return ocp


class Acados:
    """acados with the end height hard or priced."""

    def __init__(self, folder, priced):
        from acados_template import AcadosOcpSolver

        self.folder, self.priced, self.solvers, self.plan = folder, priced, {}, None
        os.makedirs(folder, exist_ok=True)
        self.ocp = problem(priced)
        self.ocp.code_export_directory = os.path.join(folder, self.ocp.model.name)
        self.json = os.path.join(folder, self.ocp.model.name + ".json")
        with silent(folder):
            AcadosOcpSolver.generate(self.ocp, json_file=self.json)
            AcadosOcpSolver.build(self.ocp.code_export_directory, with_cython=False, verbose=False)

    def solver(self, intervals):
        """The solver of a horizon."""
        from acados_template import AcadosOcpSolver

        if intervals not in self.solvers:
            with silent(self.folder):
                made = AcadosOcpSolver(None, json_file=self.json, build=False, generate=False, verbose=False)
                if intervals != landing.HORIZON:
                    made.set_new_time_steps(np.full(intervals, landing.STEP_S))
                    made.update_qp_solver_cond_N(min(5, intervals))
            self.solvers[intervals] = made
        return self.solvers[intervals]

    def fill(self, solver, start, states, inputs, multipliers):
        """Puts a start and a first path into a solver."""
        intervals = len(inputs)
        for bound in ("lbx", "ubx"):
            solver.set(0, bound, start)
        for k in range(intervals + 1):
            solver.set(k, "x", states[k])
            if k < intervals:
                solver.set(k, "u", np.array([inputs[k]]))
        dynamics, bounds = multipliers if multipliers else (None, None)
        # Multiplier of the start, which the end of the step before it was in the plan.
        of_start = np.zeros(6)
        if dynamics is not None:
            _, by_state, _ = rollout.tangent(states[0], inputs[0])
            of_start = np.array(by_state).T @ dynamics[0]
        for k in range(intervals + 1):
            multiplier = np.zeros(len(solver.get(k, "lam")))
            if bounds is not None:
                # The first stage has multipliers of the start, too; a later one of the plan becomes the first.
                here, there = len(multiplier) // 2, len(bounds[k]) // 2
                shared = min(here, there)
                multiplier[:shared], multiplier[here : here + shared] = bounds[k][:shared], bounds[k][there : there + shared]
                if k == 0 and here == 7:
                    multiplier[1:7], multiplier[8:] = np.maximum(of_start, 0.0), np.maximum(-of_start, 0.0)
            solver.set(k, "lam", multiplier)
            if k < intervals:
                solver.set(k, "pi", dynamics[k] if dynamics is not None else np.zeros(6))
        if self.priced:
            for slack in ("sl", "su"):
                solver.set(intervals, slack, np.zeros(1))

    def solve(self, start, states, inputs, multipliers=None):
        """Solves twice from a path; the second run is timed."""
        intervals = len(inputs)
        solver = self.solver(intervals)
        solver.options_set("globalization", "fixed_step" if multipliers else "merit_backtracking")
        # Without its slacks even an optimum looks unsolved to it.
        solver.options_set("initialize_t_slacks", 1 if multipliers else 0)
        for _ in range(2):
            solver.reset()
            self.fill(solver, start, states, inputs, multipliers)
            before = time.thread_time_ns()
            status = solver.solve()
            ns = time.thread_time_ns() - before
        found = np.array([solver.get(k, "x") for k in range(intervals + 1)])
        gimbals = np.array([solver.get(k, "u")[0] for k in range(intervals)])
        dynamics = [solver.get(k, "pi") for k in range(intervals)]
        bounds = [solver.get(k, "lam") for k in range(intervals + 1)]
        cost = landing.STEP_S * 0.5 * (
            ((found[1:] - landing.TARGET) ** 2 @ landing.STATE_WEIGHTS).sum() + landing.INPUT_WEIGHT * gimbals @ gimbals
        )
        lands = abs(found[-1, Z]) <= solvers.LANDING_MISS_M
        plan = (found, gimbals, dynamics, bounds)
        iterations = int(np.ravel(solver.get_stats("sqp_iter"))[0])
        return solvers.Result(status == 0, ns, iterations, float(cost), gimbals, plan, lands)

    def cold(self, start, bend):
        first = solvers.guess(start, bend).reshape(-1, 7)
        return self.solve(start, np.vstack([start, first[:, 1:]]), first[:, 0])

    def adopt(self, start, states, inputs):
        """Converges from a given optimum; holds it."""
        result = self.solve(start, np.asarray(states), np.asarray(inputs))
        self.hold(result)
        return result

    def hold(self, result):
        self.plan = result.plan

    def warm(self, samples, start, retry=False):
        """Solves what is left some samples after the plan began, from the plan shifted and rolled out from where the
        vehicle is (a hard end height needs that); with `retry`, without multipliers."""
        states, inputs, dynamics, bounds = self.plan
        inputs = inputs[samples:]
        path = [np.asarray(start, dtype=float)]
        for gimbal in inputs:
            path.append(np.array(landing.STEP(path[-1], gimbal)).ravel())
        multipliers = None if retry else (dynamics[samples:], bounds[samples:])
        return self.solve(start, np.array(path), inputs, multipliers)
