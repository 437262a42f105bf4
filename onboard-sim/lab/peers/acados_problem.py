"""The landing as acados takes it, and where acados is.

Interface and libraries are those of the installation in ACADOS_SOURCE_DIR, or else of the wheel `comma-deps-acados`, which
`run` puts into a folder of its own: the wheel brings a CasADi that would overwrite the right one.
"""

import ctypes
import dataclasses
import importlib.metadata
import os
import sys

import casadi as ca
import numpy as np

import landing
from result import MOST_ITERATIONS

# Curvature of the penalty, which the QP wants, cost units per square metre; smaller ones fail more often.
PENALTY_CURVATURE = 10.0

# Gauss-Newton steps converge slowly, where they do.
MOST_GAUSS_NEWTON_ITERATIONS = 200

# Blocks that partial condensing leaves.
BLOCKS = 5

X, Z = 0, 1


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
    for HPIPM."""

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
        return "_".join(("landing", self.problem, *parts))


def problem(kind):
    """The landing, to be solved in one way."""
    from acados_template import AcadosModel, AcadosOcp

    ocp, model = AcadosOcp(), AcadosModel()
    state, gimbal = ca.SX.sym("x", 6), ca.SX.sym("u")
    model.name = kind.model_name
    model.x, model.u, model.p = state, gimbal, ca.SX.sym("p", 0)
    model.disc_dyn_expr = landing.STEP(state, gimbal)
    ocp.model = model
    ocp.dims.N = landing.HORIZON
    _penalty(ocp)
    _limit(ocp, kind)
    _options(ocp.solver_options, kind)
    return ocp


def _penalty(ocp):
    """The running cost. The start costs nothing, the end costs a whole step: a sum over the ends of the intervals."""
    weights, target = np.diag(landing.STATE_WEIGHTS), landing.TARGET
    cost = ocp.cost
    cost.cost_type_0 = cost.cost_type = cost.cost_type_e = "LINEAR_LS"
    cost.W_0, cost.Vx_0, cost.Vu_0 = np.array([[landing.INPUT_WEIGHT]]), np.zeros((1, 6)), np.ones((1, 1))
    cost.yref_0 = np.zeros(1)
    cost.W = np.block([[weights, np.zeros((6, 1))], [np.zeros((1, 6)), landing.INPUT_WEIGHT]])
    cost.Vx, cost.Vu = np.eye(7, 6), np.eye(7, 1, -6)
    cost.yref = np.append(target, 0.0)
    cost.W_e, cost.Vx_e, cost.yref_e = landing.STEP_S * weights, np.eye(6), target


def _limit(ocp, kind):
    """Gimbal, distance and height at the end."""
    limits, cost = ocp.constraints, ocp.cost
    limits.x0 = np.array([0.0, 15.0, np.pi / 2.0, -5.0, 0.0, 0.0])
    limits.idxbu = np.array([0])
    limits.lbu, limits.ubu = np.array([-landing.GIMBAL_LIMIT_RAD]), np.array([landing.GIMBAL_LIMIT_RAD])
    limits.idxbx_e = np.array([X, Z])
    limits.lbx_e, limits.ubx_e = np.array([-landing.X_FINAL_M, 0.0]), np.array([landing.X_FINAL_M, 0.0])
    if kind.problem == landing.SOFT:
        limits.idxsbx_e = np.array([1])
        cost.zl_e = cost.zu_e = np.array([landing.PENALTY_PER_M])
        cost.Zl_e = cost.Zu_e = np.array([PENALTY_CURVATURE])


def _options(options, kind):
    options.tf = landing.HORIZON * landing.STEP_S
    options.integrator_type = "DISCRETE"
    options.nlp_solver_type = "SQP_RTI" if kind.rti else "SQP"
    options.hessian_approx = "EXACT" if kind.exact else "GAUSS_NEWTON"
    options.regularize_method = "CONVEXIFY" if kind.exact else "NO_REGULARIZE"
    options.qp_solver = "FULL_CONDENSING_HPIPM" if kind.full else "PARTIAL_CONDENSING_HPIPM"
    if not kind.full:
        options.qp_solver_cond_N = BLOCKS
    if not kind.rti:
        options.globalization = os.environ.get("ACADOS_GLOBALIZATION", "MERIT_BACKTRACKING")
    options.nlp_solver_max_iter = MOST_ITERATIONS if kind.exact else MOST_GAUSS_NEWTON_ITERATIONS
    options.qp_solver_iter_max = 100
    options.qp_solver_warm_start = 0
    for tolerance in ("stat", "eq", "ineq", "comp"):
        setattr(options, f"nlp_solver_tol_{tolerance}", landing.TOLERANCE)
    options.print_level = 0
    options.ext_fun_compile_flags = "-O3 -march=native"
