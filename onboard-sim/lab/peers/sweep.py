"""One Newton step of the landing problem, written to do as little arithmetic as its structure allows.

Per interval: the RK4 step, its adjoint, its tangents and the exact second derivative of `costate . step`, by the
five directions (theta, u, w, q, delta); then the backward Riccati sweep, the forward sweep and the new costates.
x and z are integrators, q and theta known in closed form, `P` symmetric, sums and products with known 0 and 1 left out.
Run with `Number`s it counts itself; `check` compares what it computes with CasADi's derivatives and with a dense
solution of the same linear system.
"""

import casadi as ca
import numpy as np

import landing
from counted import root, sine_cosine

AHEAD, WEIGHTS, TURNED = (0, 0.5, 0.5, 1), (1 / 6, 1 / 3, 1 / 3, 1 / 6), (0, 0, 0.5, 1)
TH, U, W, Q, D = range(5)
H = landing.STEP_S
KD, G = landing.DRAG_PER_M, landing.GRAVITY_M_S2


def dot(left, right):
    """Sum of products."""
    total = 0
    for a, b in zip(left, right):
        total = total + a * b
    return total


def interval(state, gimbal, costate):
    """The state after, the gradient of `costate . step`, its tangents (x, z, u, w; theta, q) and its curvature."""
    x0, z0, th0, u0, w0, q0 = state
    sin_d, cos_d = sine_cosine(gimbal)
    thrust = landing.THRUST_N / landing.MASS_KG
    torque = landing.THRUST_N * landing.ARM_M / landing.INERTIA_KG_M2
    push, side = cos_d * thrust, sin_d * -thrust
    turn, turn_d = sin_d * -torque, cos_d * -torque
    stages, sums = [], [0, 0, 0, 0]
    u, w = u0, w0
    for i in range(4):
        q = q0 + turn * (H * AHEAD[i]) if i else q0
        theta = th0
        if i == 1:
            theta = th0 + q0 * (H / 2)
        elif i > 1:
            theta = th0 + (q0 * (AHEAD[i] * H) + turn * (0.5 * H * H * TURNED[i]))
        sin, cos = sine_cosine(theta)
        speed = root(u * u + w * w)
        inverse = 1.0 / speed
        along, across = u * inverse, w * inverse
        scaled = u * -KD
        drag, drag_w = speed * scaled, scaled * across
        drag_u = speed * -KD + scaled * along
        x_dot, z_dot = u * cos + w * sin, u * sin - w * cos
        gs, gc = sin * G, cos * G
        rates = [x_dot, z_dot, push + drag - gs - q * w, side + gc + q * u]
        sums = [s + r * (WEIGHTS[i] * H) for s, r in zip(sums, rates)]
        stages.append((sin, cos, u, w, q, x_dot, z_dot, drag_u, drag_w, along, across, gs, gc))
        if i < 3:
            u, w = u0 + rates[2] * (H * AHEAD[i + 1]), w0 + rates[3] * (H * AHEAD[i + 1])
    after = [x0 + sums[0], z0 + sums[1], th0 + (q0 * H + turn * (H * H / 2)), u0 + sums[2], w0 + sums[3], q0 + turn * H]

    lx, lz, lt, lu, lw, lq = costate
    pulled, adjoints, later = [lt, lu, lw, lq, 0], [None] * 4, None
    for i in reversed(range(4)):
        sin, cos, u, w, q, x_dot, z_dot, drag_u, drag_w, _, _, gs, gc = stages[i]
        kx, kz, kt, ku, kw, kq = (value * (WEIGHTS[i] * H) for value in (lx, lz, lt, lu, lw, lq))
        if i < 3:
            kt, ku, kw, kq = (k + l * (AHEAD[i + 1] * H) for k, l in zip((kt, ku, kw, kq), later))
        later = [
            kz * x_dot - kx * z_dot - (ku * gc + kw * gs),
            kx * cos + kz * sin + ku * drag_u + kw * q,
            kx * sin - kz * cos + ku * (drag_w - q),
            kt - ku * w + kw * u,
        ]
        by_gimbal = ku * side - kw * push + kq * turn_d
        pulled = [p + l for p, l in zip(pulled, [*later, by_gimbal])]
        adjoints[i] = (kx, kz, ku, kw, kq)

    tu, tw = [0, 1, 0, 0, 0], [0, 0, 1, 0, 0]
    tangent = [[0] * 5 for _ in range(4)]
    bend = [[0] * 5 for _ in range(5)]

    def put(row, column, value):
        bend[row][column] = bend[row][column] + value

    for i in range(4):
        sin, cos, u, w, q, x_dot, z_dot, drag_u, drag_w, along, across, gs, gc = stages[i]
        kx, kz, ku, kw, kq = adjoints[i]
        tt = [1, 0, 0, 0 if i == 0 else H * AHEAD[i], 0 if i < 2 else turn_d * (0.5 * H * H * TURNED[i])]
        tq = [0, 0, 0, 1, 0 if i == 0 else turn_d * (H * AHEAD[i])]
        # Second derivative of the weighted slope by (theta, u, w, q).
        c_tt = ku * gs - kw * gc - kx * x_dot - kz * z_dot
        c_tu, c_tw = kz * cos - kx * sin, kx * cos + kz * sin
        scale = ku * -KD
        aa, bb = along * along, across * across
        scaled = scale * along
        c_uu, c_ww, c_uw = scaled * (3.0 - aa), scaled * (1.0 - bb), scale * across * (1.0 - aa)
        ct = [c_tt * tt[j] + c_tu * tu[j] + c_tw * tw[j] for j in range(5)]
        cu = [c_tu * tt[j] + c_uu * tu[j] + c_uw * tw[j] + kw * tq[j] for j in range(5)]
        cw = [c_tw * tt[j] + c_uw * tu[j] + c_ww * tw[j] - ku * tq[j] for j in range(5)]
        cq = [kw * tu[j] - ku * tw[j] for j in range(5)]
        for row in range(5):
            for column in range(row, 5):
                put(row, column, dot((tt[row], tu[row], tw[row], tq[row]), (ct[column], cu[column], cw[column], cq[column])))
        put(D, D, 0 - ku * push - kw * side - kq * turn)
        # Tangents of the slope by the directions.
        r_uw = drag_w - q
        du = [drag_u * tu[j] + r_uw * tw[j] - gc * tt[j] - w * tq[j] for j in range(5)]
        dw = [q * tu[j] - gs * tt[j] + u * tq[j] for j in range(5)]
        dx = [cos * tu[j] + sin * tw[j] - z_dot * tt[j] for j in range(5)]
        dz = [sin * tu[j] - cos * tw[j] + x_dot * tt[j] for j in range(5)]
        du[D], dw[D] = du[D] + side, dw[D] - push
        for total, rates in zip(tangent, (dx, dz, du, dw)):
            for j in range(5):
                total[j] = total[j] + rates[j] * (WEIGHTS[i] * H)
        if i < 3:
            tu, tw = ([rate * (AHEAD[i + 1] * H) for rate in rates] for rates in (du, dw))
            tu[U], tw[W] = tu[U] + 1.0, tw[W] + 1.0
    tangent[2][U], tangent[3][W] = tangent[2][U] + 1.0, tangent[3][W] + 1.0
    rows = [tangent[0], tangent[1], [1, 0, 0, H, turn_d * (H * H / 2)], tangent[2], tangent[3], [0, 0, 0, 1, turn_d * H]]
    return after, pulled, rows, bend


def backward(rows, bends, weights, slopes, inputs, gaps):
    """Feedback (gain, offset) of every interval, last first computed; only the upper triangle of `P` is."""
    count = len(rows)
    p = [[weights[count][i] if i == j else 0 for j in range(6)] for i in range(6)]
    s = list(slopes[count])
    answers = [None] * count
    for k in reversed(range(count)):
        a, bend, gap = rows[k], bends[k], gaps[k]
        column = [[a[i][j] for i in range(6)] for j in range(5)]
        # P times the columns of (A, b); those of x and z are P's own.
        product = [[dot(p[i], column[j]) for j in range(5)] for i in range(6)]
        g = [s[i] + dot(p[i], gap) for i in range(6)]
        reach = range(5) if k else (D,)
        pulled = {j: dot(column[j], g) for j in reach}
        curvature = dot(column[D], [product[i][D] for i in range(6)]) + bend[D][D] + inputs[k][0]
        inverse = 1.0 / curvature
        offset = (inputs[k][1] + pulled[D]) * inverse
        if k == 0:
            answers[0] = (None, offset)
            break
        cross = [product[0][D], product[1][D]]
        cross += [dot(column[j], [product[i][D] for i in range(6)]) + bend[j][D] for j in range(4)]
        gain = [c * inverse for c in cross]
        answers[k] = (gain, offset)
        new = [[None] * 6 for _ in range(6)]
        for i in range(6):
            for j in range(i, 6):
                if j < 2:
                    value = p[i][j]
                elif i < 2:
                    value = product[i][j - 2]
                else:
                    value = dot(column[i - 2], [product[n][j - 2] for n in range(6)]) + bend[i - 2][j - 2]
                value = value - gain[i] * cross[j]
                new[i][j] = new[j][i] = value + weights[k][i] if i == j else value
        s = [slopes[k][i] + (g[i] if i < 2 else pulled[i - 2]) - cross[i] * offset for i in range(6)]
        p = new
    return answers


def forward(rows, answers, gaps):
    """Changes of states and inputs."""
    changes, moves = [[0] * 6], []
    for k, (gain, offset) in enumerate(answers):
        dx = changes[-1]
        move = -(offset + dot(gain, dx)) if gain else -offset
        moved = [*dx[2:], move]
        through = [dot(rows[k][i], moved) for i in range(6)]
        changes.append([through[i] + gaps[k][i] + (dx[i] if i < 2 else 0) for i in range(6)])
        moves.append(move)
    return changes, moves


def costates(rows, bends, weights, slopes, changes, moves):
    """The costates after the step, into every node but the first."""
    count = len(rows)
    result = [None] * (count + 1)
    result[count] = [slopes[count][i] + weights[count][i] * changes[count][i] for i in range(6)]
    for k in range(count - 1, 0, -1):
        later, moved = result[k + 1], [*changes[k][2:], moves[k]]
        result[k] = []
        for i in range(6):
            value = slopes[k][i] + weights[k][i] * changes[k][i]
            if i < 2:
                value = value + later[i]
            else:
                bend = [bends[k][min(i - 2, j)][max(i - 2, j)] for j in range(5)]
                value = value + dot([rows[k][n][i - 2] for n in range(6)], later) + dot(bend, moved)
            result[k].append(value)
    return result


def check(states, gimbals, lambdas, evaluated, weights, slopes, inputs, gaps, changes, moves):
    """Largest difference from CasADi's derivatives and from a dense solution, relative to the largest entry."""
    point, gimbal, weight = ca.SX.sym("x", 6), ca.SX.sym("d"), ca.SX.sym("l", 6)
    both = ca.vertcat(point, gimbal)
    after = landing.STEP(point, gimbal)
    hessian, _ = ca.hessian(ca.dot(weight, after), both)
    truth = ca.Function("truth", [point, gimbal, weight], [after, ca.jacobian(after, both), hessian])
    count, worst = len(gimbals), 0.0
    size = 7 * count
    kkt, right = np.zeros((size + 6 * count, size + 6 * count)), np.zeros(size + 6 * count)
    for k in range(count):  # (dd_k, dx_{k+1}) and the costate into k + 1
        values = [np.array(m) for m in truth(states[k], gimbals[k], lambdas[k])]
        ours_after, _, rows, bend = evaluated[k]
        table = np.array([[float(v) for v in row] for row in rows])
        bend = np.array([[float(bend[min(i, j)][max(i, j)]) for j in range(5)] for i in range(5)])
        for ours, theirs in (
            (np.array([float(v) for v in ours_after]), values[0].ravel()),
            (table, values[1][:, 2:]),
            (bend, values[2][2:, 2:]),
        ):
            worst = max(worst, np.abs(ours - theirs).max() / np.abs(theirs).max())
        at, row = 7 * k, size + 6 * k
        kkt[at, at] += values[2][6, 6] + float(inputs[k][0])
        right[at] = -float(inputs[k][1])
        kkt[at + 1 : at + 7, at + 1 : at + 7] += np.diag([float(v) for v in weights[k + 1]])
        right[at + 1 : at + 7] = [-float(v) for v in slopes[k + 1]]
        kkt[row : row + 6, at + 1 : at + 7] = -np.eye(6)
        kkt[row : row + 6, at] = values[1][:, 6]
        if k:
            kkt[row : row + 6, at - 6 : at] = values[1][:, :6]
            kkt[at - 6 : at, at - 6 : at] += values[2][:6, :6]
            kkt[at - 6 : at, at] = kkt[at, at - 6 : at] = values[2][:6, 6]
        right[row : row + 6] = [-float(v) for v in gaps[k]]
    kkt[:size, size:] = kkt[size:, :size].T
    step = np.linalg.solve(kkt, right)[:size].reshape(count, 7)
    ours = np.array([[float(moves[k]), *(float(v) for v in changes[k + 1])] for k in range(count)])
    return max(worst, np.abs(step - ours).max() / np.abs(step).max())
