"""ripopt, an interior-point method in Rust, through its C interface, with the compiled functions that IPOPT gets.

From crates.io, built for this processor, with the sparse factorisation `feral` alone: its default feature `faer` is for
small dense problems. Warm as IPOPT, but with the multipliers of the equations alone: given those of the bounds, it ends
the process (index out of bounds in `apply_warm_start`, when its preprocessing or its restoration changes the number of
variables).
"""

import ctypes
import time

import casadi as ca
import numpy as np

import space_landing
from landing import TOLERANCE
from interior import COLD, MOST_ITERATIONS, Interior
from space_landing import HARD, SOFT

# What it takes for infinite.
INFINITE = 1e30

OPTIONS = {"tol": TOLERANCE, "max_iter": MOST_ITERATIONS, "print_level": 0}
WARM_OPTIONS = {
    "warm_start_init_point": "yes",
    "mu_init": 1e-8,
    "warm_start_bound_push": 1e-9,
    "warm_start_bound_frac": 1e-9,
    "warm_start_mult_bound_push": 1e-9,
}

INTS, DOUBLES = ctypes.POINTER(ctypes.c_int), ctypes.POINTER(ctypes.c_double)
CALLBACKS = ("f", "grad_f", "g", "jac_g", "hess_l")
RESULTS = {"f": "f", "grad_f": "grad_f_x", "g": "g", "jac_g": "jac_g_x", "hess_l": "triu_hess_gamma_x_x"}


class Function(ctypes.Structure):
    """`struct function` of the bridge."""

    _fields_ = [
        ("call", ctypes.c_void_p),
        ("arg", ctypes.c_void_p),
        ("res", ctypes.c_void_p),
        ("iw", ctypes.c_void_p),
        ("w", ctypes.c_void_p),
        ("out", ctypes.c_int),
    ]


class Problem(ctypes.Structure):
    """`struct problem` of the bridge."""

    _fields_ = [(name, Function) for name in CALLBACKS] + [
        (name, ctypes.c_void_p) for name in ("parameter", "jac_row", "jac_col", "hess_row", "hess_col")
    ]


def doubles(array):
    return array.ctypes.data_as(DOUBLES)


class Functions:
    """A compiled problem, as the bridge reads it."""

    def __init__(self, library):
        self.library = ctypes.CDLL(library)
        self.kept, self.sparsity = [], {}
        self.parameter = np.zeros(ca.external("nlp_f", library).size1_in("p"))
        self.problem = Problem(parameter=self.parameter.ctypes.data)
        for name in CALLBACKS:
            setattr(self.problem, name, self._function(name, ca.external(f"nlp_{name}", library)))
        jac_row, jac_col = self.sparsity["jac_g"]
        # CasADi has the upper triangle.
        hess_col, hess_row = self.sparsity["hess_l"]
        for name, places in (("jac_row", jac_row), ("jac_col", jac_col), ("hess_row", hess_row), ("hess_col", hess_col)):
            setattr(self.problem, name, self._keep(np.array(places, dtype=np.intc)))

    def _keep(self, array):
        self.kept.append(array)
        return array.ctypes.data

    def _function(self, name, function):
        out = function.name_out().index(RESULTS[name])
        self.sparsity[name] = function.sparsity_out(out).get_triplet()
        memory = {
            part: self._keep(np.zeros(max(1, size), dtype=kind))
            for part, size, kind in (
                ("arg", function.sz_arg(), np.uintp),
                ("res", function.sz_res(), np.uintp),
                ("iw", function.sz_iw(), np.int64),
                ("w", function.sz_w(), np.float64),
            )
        }
        call = ctypes.cast(getattr(self.library, f"nlp_{name}"), ctypes.c_void_p).value
        return Function(call=call, out=out, **memory)


class Solver:
    """One problem in one ripopt. `bounds`: of variables and of equations."""

    def __init__(self, ripopt, bridge, functions, bounds, how):
        self.ripopt, self.functions, self.how = ripopt, functions, how
        lower, upper, least, most = (np.clip(bound, -INFINITE, INFINITE) for bound in bounds)
        self.variables, self.equations = len(lower), len(least)
        nonzeros = [len(functions.sparsity[name][0]) for name in ("jac_g", "hess_l")]
        callbacks = [ctypes.cast(getattr(bridge, f"bridge_{name}"), ctypes.c_void_p) for name in CALLBACKS]
        self.handle = ctypes.c_void_p(
            ripopt.ripopt_create(
                self.variables, doubles(lower), doubles(upper), self.equations, doubles(least), doubles(most), *nonzeros, 0, *callbacks
            )
        )
        options = dict(OPTIONS)
        if how != COLD:
            options |= WARM_OPTIONS
        for key, value in options.items():
            self._set(key, value)

    def _set(self, key, value):
        keyword, ripopt = key.encode(), self.ripopt
        if isinstance(value, str):
            taken = ripopt.ripopt_add_str_option(self.handle, keyword, value.encode())
        elif isinstance(value, int):
            taken = ripopt.ripopt_add_int_option(self.handle, keyword, value)
        else:
            taken = ripopt.ripopt_add_num_option(self.handle, keyword, ctypes.c_double(value))
        if not taken:
            raise SystemExit(f"ripopt does not take {key} = {value}")

    def solve(self, parameter, first, _lam_x=None, lam_g=None):
        """Solves twice from a path, and warm from the equations' multipliers, and times the second: (converged, ns, iterations,
        plan). Given bounds' multipliers, 0.8.2 reads past their end when its preprocessing or restoration changes the number
        of variables, and ends the process."""
        self.functions.parameter[:] = parameter
        for _ in range(2):
            found, of_equations = first.copy(), np.zeros(self.equations)
            if self.how != COLD:
                of_equations[:] = lam_g
            of_lower, of_upper = np.zeros(self.variables), np.zeros(self.variables)
            # All its threads, if it had any.
            before = time.process_time_ns()
            status = self.ripopt.ripopt_solve(
                self.handle, doubles(found), None, None, doubles(of_equations), doubles(of_lower), doubles(of_upper), ctypes.byref(self.functions.problem)
            )
            ns = time.process_time_ns() - before
        return status == 0, ns, self.ripopt.ripopt_get_iter_count(self.handle), (found, of_lower, of_equations)


class Ripopt(Interior):
    """On one of the two problems."""

    def __init__(self, ripopt, bridge, problem, folder):
        super().__init__("ripopt", problem, folder)
        self.ripopt, self.bridge = ripopt, bridge

    def made(self, intervals, how, limits):
        functions = Functions(space_landing.library_path("ipopt", intervals, self.problem, self.folder))
        return Solver(self.ripopt, self.bridge, functions, limits, how)


def entrants(library, bridge, folder):
    """Called by `worker`."""
    ripopt, bridge = ctypes.CDLL(library), ctypes.CDLL(bridge)
    ripopt.ripopt_create.restype = ctypes.c_void_p
    number = (ctypes.c_int(), ctypes.c_int(), ctypes.c_int())
    ripopt.ripopt_get_version(*map(ctypes.byref, number))
    version = ".".join(str(part.value) for part in number)
    return f"ripopt {version}", [Ripopt(ripopt, bridge, problem, folder) for problem in (HARD, SOFT)]
