"""A landing, in the plane or in space, as acados takes it, and where acados is.

Interface and libraries are those of the installation in ACADOS_SOURCE_DIR, or else of the wheel `comma-deps-acados`, which
`run` puts into a folder of its own: the wheel brings a CasADi that would overwrite the right one.
"""

import ctypes
import dataclasses
import importlib.metadata
import os
import sys
import types

import casadi as ca
import numpy as np

import landing
import space_landing
from result import MOST_ITERATIONS

# Curvature of the penalty, which the QP wants, cost units per square metre; smaller ones fail more often.
PENALTY_CURVATURE = 10.0

# Gauss-Newton steps converge slowly, where they do.
MOST_GAUSS_NEWTON_ITERATIONS = 200

# For a bound that a node has not, but another has, larger than any state.
LOOSE = 100.0

# Blocks that partial condensing leaves, in the plane and in space: the fastest.
BLOCKS = {landing: 5, space_landing: 10}

# In space CONVEXIFY diverges, even from nearly the optimum: it does not work with bounds of states (acados issues 372 and 1392).
# PROJECT converges, as slowly as Gauss-Newton steps.
REGULARIZE = {landing: "CONVEXIFY", space_landing: "PROJECT"}
MOST_SPACE_ITERATIONS = 1000


def installed(wheel_folder):
    """Makes acados importable; the words for its version."""
    source = os.environ.get("ACADOS_SOURCE_DIR")
    if source:
        sys.path.insert(0, os.path.join(source, "interfaces", "acados_template"))
        return f"acados in {source}"
    # Behind CasADi's own folder.
    sys.path.append(wheel_folder)
    import acados

    # Its libraries do not find each other by themselves.
    for library in ("libblasfeo.so", "libqpOASES_e.so.3.1", "libhpipm.so", "libacados.so"):
        ctypes.CDLL(os.path.join(acados.LIB_DIR, library), mode=ctypes.RTLD_GLOBAL)
    version = importlib.metadata.version("comma-deps-acados")
    os.environ["ACADOS_SOURCE_DIR"] = acados.DIR
    os.environ["ACADOS_PYTHON_INTERFACE_PATH"] = acados.TEMPLATE_DIR
    os.environ["TERA_PATH"] = acados.TERA_PATH
    sys.path.insert(0, os.path.dirname(acados.TEMPLATE_DIR))
    return f"acados, the wheel comma-deps-acados {version}"


@dataclasses.dataclass(frozen=True)
class Kind:
    """One way to solve: converged SQP or real-time iteration, exact or Gauss-Newton Hessian, and how the QP is condensed
    for HPIPM. `posed`: `landing` or `space_landing`."""

    posed: types.ModuleType
    problem: str
    rti: bool
    exact: bool
    full: bool

    @property
    def name(self):
        method = "RTI" if self.rti else "SQP"
        hessian = "exact" if self.exact else "Gauss-Newton"
        return f"acados {method}, {hessian}, {'full' if self.full else 'partial'}"

    @property
    def model_name(self):
        parts = ("rti" if self.rti else "sqp", "exact" if self.exact else "gn", "full" if self.full else "partial")
        return "_".join((self.posed.__name__, self.problem, *parts))


def problem(kind):
    """The landing, to be solved in one way."""
    from acados_template import AcadosModel, AcadosOcp

    posed, ocp, model = kind.posed, AcadosOcp(), AcadosModel()
    # In space an interval has a parameter, its thrust.
    given = [ca.SX.sym(name, posed.STEP.size1_in(index)) for index, name in enumerate(("x", "u", "p")[: posed.STEP.n_in()])]
    model.name = kind.model_name
    model.x, model.u, model.p = given if len(given) == 3 else (*given, ca.SX.sym("p", 0))
    model.disc_dyn_expr = posed.STEP(*given)
    ocp.model = model
    ocp.dims.N = posed.HORIZON
    ocp.parameter_values = np.zeros(model.p.shape[0])
    _penalty(ocp, posed)
    _limit(ocp, kind)
    _options(ocp.solver_options, kind)
    return ocp


def _penalty(ocp, posed):
    """The running cost. The start costs nothing, the end costs a whole step: a sum over the ends of the intervals."""
    weights, input_weights = np.diag(posed.STATE_WEIGHTS), np.diag(posed.INPUT_WEIGHTS)
    cost, states, inputs = ocp.cost, posed.STATES, posed.INPUTS
    cost.cost_type_0 = cost.cost_type = cost.cost_type_e = "LINEAR_LS"
    cost.W_0, cost.Vx_0, cost.Vu_0, cost.yref_0 = input_weights, np.zeros((inputs, states)), np.eye(inputs), posed.REST
    none = np.zeros((states, inputs))
    cost.W = np.block([[weights, none], [none.T, input_weights]])
    cost.Vx, cost.Vu = np.eye(states + inputs, states), np.eye(states + inputs, inputs, -states)
    cost.yref = np.append(posed.TARGET, posed.REST)
    cost.W_e, cost.Vx_e, cost.yref_e = posed.STEP_S * weights, np.eye(states), posed.TARGET


def bounded(kind, intervals):
    """Lower and upper bounds (of inputs and of the next state) by interval, the states that have some on the way and at the
    end, and which of those have a price there."""
    width = kind.posed.INPUTS + kind.posed.STATES
    by_problem = [
        [bound[: intervals * width].reshape(-1, width) for bound in kind.posed.bounds(intervals, problem)]
        for problem in (landing.HARD, kind.problem)
    ]
    hard, kept = (np.isfinite(lower) | np.isfinite(upper) for lower, upper in by_problem)
    places = []
    for nodes in (slice(None, -1), slice(-1, None)):
        index = np.flatnonzero(hard[nodes, kind.posed.INPUTS :].any(axis=0))
        priced = (hard & ~kept)[nodes, kind.posed.INPUTS :].any(axis=0)
        places.append((index, np.flatnonzero(priced[index])))
    lower, upper = (np.clip(bound, -LOOSE, LOOSE) for bound in by_problem[0])
    return lower, upper, places


def _limit(ocp, kind):
    """Of inputs and states; `acados_solver` sets those of a state by node."""
    limits, cost, inputs = ocp.constraints, ocp.cost, kind.posed.INPUTS
    lower, upper, ((way, way_priced), (end, end_priced)) = bounded(kind, kind.posed.HORIZON)
    limits.x0 = np.zeros(kind.posed.STATES)
    limits.idxbu, limits.lbu, limits.ubu = np.arange(inputs), lower[0, :inputs], upper[0, :inputs]
    limits.idxbx, limits.lbx, limits.ubx = way, lower[0, inputs + way], upper[0, inputs + way]
    limits.idxbx_e, limits.lbx_e, limits.ubx_e = end, lower[-1, inputs + end], upper[-1, inputs + end]
    limits.idxsbx, limits.idxsbx_e = way_priced, end_priced
    # acados multiplies those on the way with the time step.
    for field, priced, step in (("", way_priced, kind.posed.STEP_S), ("_e", end_priced, 1.0)):
        for side in "lu":
            setattr(cost, f"z{side}{field}", np.full(len(priced), landing.PENALTY_PER_M / step))
            setattr(cost, f"Z{side}{field}", np.full(len(priced), PENALTY_CURVATURE / step))


def _options(options, kind):
    options.tf = kind.posed.HORIZON * kind.posed.STEP_S
    options.integrator_type = "DISCRETE"
    options.nlp_solver_type = "SQP_RTI" if kind.rti else "SQP"
    options.hessian_approx = "EXACT" if kind.exact else "GAUSS_NEWTON"
    options.regularize_method = REGULARIZE[kind.posed] if kind.exact else "NO_REGULARIZE"
    options.qp_solver = "FULL_CONDENSING_HPIPM" if kind.full else "PARTIAL_CONDENSING_HPIPM"
    if not kind.full:
        options.qp_solver_cond_N = BLOCKS[kind.posed]
    if not kind.rti:
        options.globalization = os.environ.get("ACADOS_GLOBALIZATION", "MERIT_BACKTRACKING")
    options.nlp_solver_max_iter = MOST_ITERATIONS if kind.exact else MOST_GAUSS_NEWTON_ITERATIONS
    if kind.posed is space_landing:
        options.nlp_solver_max_iter = MOST_SPACE_ITERATIONS
    options.qp_solver_iter_max = 100
    options.qp_solver_warm_start = 0
    for tolerance in ("stat", "eq", "ineq", "comp"):
        setattr(options, f"nlp_solver_tol_{tolerance}", landing.TOLERANCE)
    options.print_level = 0
    options.ext_fun_compile_flags = "-O3 -march=native"
