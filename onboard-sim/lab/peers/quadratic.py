"""The quadratic problem of one Gauss-Newton step, solved by ours, PIQP and HPIPM: the same numbers, from our program.

It linearises the dynamics at a landing from whose start the vehicle was then kicked; z_N = 0 is hard. Times are those of the solve
alone. All stop at 1e-6, and all are cold: ours begins at the landing, but with the barrier of a cold solve. PIQP has its
block-tridiagonal factorisation and, to compare, its sparse one, in the widest vectors of the machine. HPIPM, without condensing, is
that of acados, whose BLASFEO is built for AVX2.
"""

import ctypes
import importlib.metadata
import os
import time

import numpy as np

import acados_problem
import landing
from measure import SMALL
from tables import NS_PER_MS, geometric, head, number, row

ROUNDS = 2 if SMALL else 7
KICK = np.array([0.0, 0.0, 0.0, 0.02, 0.02, np.radians(0.5)])
KICK_SIGNS = ((1, 1, 1), (-1, 1, 1), (1, -1, 1), (-1, -1, -1))

# The paper's seven: nominal, tilted, drifting, turning.
STARTS = [
    np.array([0.0, 15.0, np.radians(pitch_deg), -5.0, w, np.radians(q_deg)])
    for pitch_deg, w, q_deg in ((90, 0, 0), (60, 0, 0), (120, 0, 0), (90, -1, 0), (90, 1, 0), (90, 0, -5), (90, 0, 5))
]

# An answer that costs more than the cheapest by this share, or misses the end height by this many metres, is wrong.
WRONG = 1e-5

COUNT, LIMIT = landing.HORIZON, landing.GIMBAL_LIMIT_RAD
WEIGHTS, INPUT_WEIGHT = landing.STEP_S * landing.STATE_WEIGHTS, landing.STEP_S * landing.INPUT_WEIGHT


def timed(solve):
    """Solves twice, and times the second, ns."""
    solve()
    before = time.thread_time_ns()
    solve()
    return time.thread_time_ns() - before


class Piqp:
    """Its variables are (u_0, x_1, u_1, ..., x_N)."""

    problem = None

    def __init__(self, factorisation):
        self.name, self.factorisation = f"PIQP, {factorisation}", factorisation

    def quadratic(self, a, b, c):
        import piqp
        from scipy import sparse

        equations = np.zeros((COUNT, 6, COUNT, 7))
        for k in range(COUNT):
            equations[k, :, k] = np.column_stack([b[k], -np.eye(6)])
            if k:
                equations[k, :, k - 1, 1:] = a[k]
        weights = sparse.diags(np.tile([INPUT_WEIGHT, *WEIGHTS], COUNT), format="csc")
        slope = np.tile([0.0, *(-WEIGHTS * landing.TARGET)], COUNT)
        solver = piqp.SparseSolver()
        chosen = solver.settings
        chosen.kkt_solver = getattr(piqp.KKTSolver, f"sparse_{self.factorisation}")
        chosen.eps_abs = chosen.eps_duality_gap_abs = chosen.eps_duality_gap_rel = landing.TOLERANCE
        chosen.eps_rel, chosen.compute_timings = 0.0, True
        equations = sparse.csc_matrix(equations.reshape(6 * COUNT, 7 * COUNT))
        solver.setup(weights, slope, equations, -c.ravel(), None, None, None, *landing.bounds(COUNT))
        ns, info = timed(solver.solve), solver.result.info
        # One factorisation and two solves an iteration.
        swept = 1e9 * (info.kkt_factor_time + info.kkt_solve_time / 2) / info.iter
        return info.status == piqp.PIQP_SOLVED, ns, info.iter, swept, solver.result.x[::7].copy()


class Hpipm:
    """Through its C interface; the first stage has no state."""

    problem = None

    def __init__(self, mode, number_of):
        self.name, self.kept = f"HPIPM, {mode}", []
        folder = os.path.join(os.environ["ACADOS_SOURCE_DIR"], "lib")
        ctypes.CDLL(os.path.join(folder, "libblasfeo.so"), mode=ctypes.RTLD_GLOBAL)
        self.library = ctypes.CDLL(os.path.join(folder, "libhpipm.so"))
        dim = self.made("dim", COUNT)
        sizes = {"nx": [0] + [6] * COUNT, "nu": [1] * COUNT + [0], "nbu": [1] * COUNT + [0], "nbx": [0] * COUNT + [2]}
        for field, values in sizes.items():
            for k, value in enumerate(values):
                self.library.d_ocp_qp_dim_set(field.encode(), k, value, dim)
        self.posed, self.found, self.chosen = self.made("", dim), self.made("sol", dim), self.made("ipm_arg", dim)
        self.library.d_ocp_qp_ipm_arg_set_default(number_of, self.chosen)
        for which in ("stat", "eq", "ineq", "comp"):
            tolerance = ctypes.byref(ctypes.c_double(landing.TOLERANCE))
            self.library.d_ocp_qp_ipm_arg_set(f"tol_{which}".encode(), tolerance, self.chosen)
        self.room = self.made("ipm_ws", dim, self.chosen)

    def made(self, kind, *given):
        """One of its structures, in memory that is kept."""
        of = lambda what: getattr(self.library, "_".join(["d_ocp_qp", *kind.split(), what]))
        of("strsize").restype = of("memsize").restype = ctypes.c_size_t
        structure, memory = (ctypes.create_string_buffer(size) for size in (of("strsize")(), of("memsize")(*given)))
        of("create")(*given, structure, memory)
        self.kept += [structure, memory]
        return structure

    def set(self, stage, **fields):
        for field, value in fields.items():
            array = np.asfortranarray(value, dtype=np.int32 if field.startswith("idx") else float)
            self.library.d_ocp_qp_set(field.encode(), stage, ctypes.c_void_p(array.ctypes.data), self.posed)

    def quadratic(self, a, b, c):
        for k in range(COUNT):
            self.set(k, B=b[k], b=c[k], R=INPUT_WEIGHT, r=0.0, idxbu=0, lbu=-LIMIT, ubu=LIMIT, **({"A": a[k]} if k else {}))
            self.set(k + 1, Q=np.diag(WEIGHTS), q=-WEIGHTS * landing.TARGET, S=np.zeros((1, 6)))
        self.set(COUNT, idxbx=[0, 1], lbx=[-landing.X_FINAL_M, 0.0], ubx=[landing.X_FINAL_M, 0.0])
        ns = timed(lambda: self.library.d_ocp_qp_ipm_solve(self.posed, self.found, self.chosen, self.room))
        status, iterations, gimbals = ctypes.c_int(), ctypes.c_int(), np.zeros(COUNT)
        self.library.d_ocp_qp_ipm_get(b"status", self.room, ctypes.byref(status))
        self.library.d_ocp_qp_ipm_get(b"iter", self.room, ctypes.byref(iterations))
        for k in range(COUNT):
            self.library.d_ocp_qp_sol_get(b"u", k, self.found, ctypes.c_void_p(gimbals[k:].ctypes.data))
        # Once more at the last iterate. `struct d_ocp_qp_ipm_ws` is four residuals and then pointers: the fourth to the
        # step, the sixth to its problem.
        pointers = [ctypes.c_void_p(at) for at in ctypes.cast(self.room, ctypes.POINTER(ctypes.c_size_t))[4:10]]
        swept = timed(lambda: self.library.d_ocp_qp_fact_solve_kkt_step(pointers[5], pointers[3], self.chosen, self.room))
        return status.value == 0, ns, iterations.value, swept, gimbals


def entrants(peer, wheel):
    """Called by `worker`, for each peer in a process of its own: both bring a BLASFEO."""
    if peer == "piqp":
        return f"PIQP {importlib.metadata.version(peer)}", [Piqp("multistage"), Piqp("ldlt")]
    return f"HPIPM of {acados_problem.installed(wheel)}", [Hpipm("speed", 1), Hpipm("robust", 3)]


def cost(posed, answer):
    """Of an answer's inputs; infinite if it has not converged or misses the end height."""
    state, total = np.zeros(6), 0.0
    for a, b, c, gimbal in zip(*posed, np.clip(answer[4], -LIMIT, LIMIT)):
        state = a @ state + b * gimbal + c
        total += 0.5 * (WEIGHTS @ (state - landing.TARGET) ** 2 + INPUT_WEIGHT * gimbal**2)
    return total if answer[0] and abs(state[1]) <= WRONG else np.inf


def run(ours, public):
    """The table. An entrant's answer is (converged, ns, iterations, ns of a factorisation and a solve, inputs)."""
    found = []
    for start in STARTS[:: 2 if SMALL else 1]:
        ours.plane_cold(start)
        for signs in KICK_SIGNS:
            rounds = []
            for _ in range(ROUNDS):
                kicked = start + KICK * np.array([0, 0, 0, *signs])
                numbers, answer = ours.quadratic(kicked)
                # x_{k+1} = A x_k + B u_k + c; the first, from zero, has the start in its c.
                a, b, c = numbers[:, :6].transpose(0, 2, 1), numbers[:, 6], numbers[:, 7]
                c[0] += a[0] @ kicked
                rounds.append([answer, *(entrant.quadratic(a, b, c) for entrant in public)])
            each = zip(*rounds)
            found.append([[*np.min([a[1:4] for a in answers], axis=0), cost((a, b, c), answers[0])] for answers in each])
    found = np.array(found)
    right = found[:, :, 3] <= found[:, :, 3].min(axis=1, keepdims=True) * (1.0 + WRONG)
    print(f"\n**quadratic problem of one Gauss-Newton step**: {len(found)}, the least times of {ROUNDS} rounds\n")
    head(["", "ms", "ratio", "iterations", "factorisation and solve, us", "ratio", "fail"])
    for index, name in enumerate(["ours", *(entrant.name for entrant in public)]):
        use = right[:, index]
        (ns, iterations, swept, _), own = found[use, index].T, found[use, 0].T
        cells = [geometric(ns) / NS_PER_MS, geometric(ns / own[0]), iterations.mean(), geometric(swept) / 1e3]
        row([name, *map(number, [*cells, geometric(swept / own[2])]), str(sum(~use))])
