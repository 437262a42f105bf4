"""The landing as acados takes it, and where acados is.

Interface and libraries are those of the installation in ACADOS_SOURCE_DIR, or else of the wheel `comma-deps-acados`, which
`run` puts into a folder of its own: the wheel brings a CasADi that would overwrite the right one.
"""

import ctypes
import importlib.metadata
import os
import sys

import casadi as ca
import numpy as np

from landing import TOLERANCE
from space_landing import (
    HARD, HORIZON, INPUT_WEIGHTS, INPUTS, PENALTY_PER_UNIT, REST, STATE_WEIGHTS, STATES, STEP, STEP_S, TARGET, WIDTH, bounds
)

# Curvature of the penalty, which the QP wants, cost units per square metre; smaller ones fail more often.
PENALTY_CURVATURE = 10.0

# For a bound that a node has not, but another has, larger than any state.
LOOSE = 100.0

# Blocks that partial condensing leaves: the fastest. Full condensing takes three times as long.
BLOCKS = 10

# CONVEXIFY diverges, even from nearly the optimum: it does not work with bounds of states (acados issues 372 and 1392). PROJECT
# converges, if slowly; Gauss-Newton steps are slower.
REGULARIZE, MOST_ITERATIONS = "PROJECT", 1000


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


def model_name(end):
    return f"space_{end}"


def problem(end):
    """The landing with a hard or a priced end."""
    from acados_template import AcadosModel, AcadosOcp

    ocp, model = AcadosOcp(), AcadosModel()
    model.name = model_name(end)
    model.x, model.u, model.p = (ca.SX.sym(name, size) for name, size in (("x", STATES), ("u", INPUTS), ("p", 1)))
    model.disc_dyn_expr = STEP(model.x, model.u, model.p)
    ocp.model = model
    ocp.dims.N = HORIZON
    ocp.parameter_values = np.zeros(1)
    _penalty(ocp.cost)
    _limit(ocp, end)
    _options(ocp.solver_options)
    return ocp


def _penalty(cost):
    """The running cost. The start costs nothing, the end costs a whole step: a sum over the ends of the intervals."""
    weights, input_weights = np.diag(STATE_WEIGHTS), np.diag(INPUT_WEIGHTS)
    cost.cost_type_0 = cost.cost_type = cost.cost_type_e = "LINEAR_LS"
    cost.W_0, cost.Vx_0, cost.Vu_0, cost.yref_0 = input_weights, np.zeros((INPUTS, STATES)), np.eye(INPUTS), REST
    none = np.zeros((STATES, INPUTS))
    cost.W = np.block([[weights, none], [none.T, input_weights]])
    cost.Vx, cost.Vu, cost.yref = np.eye(WIDTH, STATES), np.eye(WIDTH, INPUTS, -STATES), np.append(TARGET, REST)
    cost.W_e, cost.Vx_e, cost.yref_e = STEP_S * weights, np.eye(STATES), TARGET


def bounded(end, intervals):
    """Lower and upper bounds (of inputs and of the next state) by interval, the states that have some on the way and at the
    end, and which of those have a price there."""
    by_end = [[bound.reshape(-1, WIDTH) for bound in bounds(intervals, which)] for which in (HARD, end)]
    hard, kept = ((np.isfinite(lower) | np.isfinite(upper))[:, INPUTS:] for lower, upper in by_end)
    places = []
    for nodes in (slice(None, -1), slice(-1, None)):
        index = np.flatnonzero(hard[nodes].any(axis=0))
        places.append((index, np.flatnonzero((hard & ~kept)[nodes].any(axis=0)[index])))
    lower, upper = (np.clip(bound, -LOOSE, LOOSE) for bound in by_end[0])
    return lower, upper, places


def _limit(ocp, which):
    """Of inputs and states; `acados_solver` sets those of a state by node."""
    limits, cost = ocp.constraints, ocp.cost
    lower, upper, ((way, way_priced), (end, end_priced)) = bounded(which, HORIZON)
    limits.x0 = np.zeros(STATES)
    limits.idxbu, limits.lbu, limits.ubu = np.arange(INPUTS), lower[0, :INPUTS], upper[0, :INPUTS]
    limits.idxbx, limits.lbx, limits.ubx = way, lower[0, INPUTS + way], upper[0, INPUTS + way]
    limits.idxbx_e, limits.lbx_e, limits.ubx_e = end, lower[-1, INPUTS + end], upper[-1, INPUTS + end]
    limits.idxsbx, limits.idxsbx_e = way_priced, end_priced
    # acados multiplies those on the way with the time step.
    for field, priced, step in (("", way_priced, STEP_S), ("_e", end_priced, 1.0)):
        for side in "lu":
            setattr(cost, f"z{side}{field}", np.full(len(priced), PENALTY_PER_UNIT / step))
            setattr(cost, f"Z{side}{field}", np.full(len(priced), PENALTY_CURVATURE / step))


def _options(options):
    options.tf = HORIZON * STEP_S
    options.integrator_type = "DISCRETE"
    options.nlp_solver_type = "SQP"
    options.hessian_approx = "EXACT"
    options.regularize_method = REGULARIZE
    options.qp_solver = "PARTIAL_CONDENSING_HPIPM"
    options.qp_solver_cond_N = BLOCKS
    options.qp_solver_iter_max = 100
    options.qp_solver_warm_start = 0
    # With a line search it is slower.
    options.globalization = "FIXED_STEP"
    options.nlp_solver_max_iter = MOST_ITERATIONS
    for tolerance in ("stat", "eq", "ineq", "comp"):
        setattr(options, f"nlp_solver_tol_{tolerance}", TOLERANCE)
    options.print_level = 0
    options.ext_fun_compile_flags = "-O3 -march=native"
