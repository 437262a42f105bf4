"""The ascent of mk2 on its booster with RocketPy: no wind, standard atmosphere, constant gravity, no Coriolis force.

python ascent.py [stack.json]
"""
import json
import math
import sys
from importlib.metadata import version
from pathlib import Path

from rocketpy import Environment, Flight, GenericMotor, Rocket


def tube(m, length, radius):
    """Pitch and roll inertia of a thin tube about its own centre."""
    return m * (radius**2 / 2 + length**2 / 12), m * radius**2


def add_up(bodies):
    """bodies: (kg, station, pitch inertia about own CG, roll inertia) -> the same of the sum."""
    m = sum(b[0] for b in bodies)
    cg = sum(b[0] * b[1] for b in bodies) / m
    return m, cg, sum(b[2] + b[0] * (b[1] - cg) ** 2 for b in bodies), sum(b[3] for b in bodies)


def part(p):
    return (p["kg"], p["station_m"], *tube(p["kg"], p["length_m"], p["radius_m"]))


def named(b):
    return {"kg": round(b[0], 6), "cg_station_m": round(b[1], 6), "pitch_inertia_kg_m2": round(b[2], 7), "roll_inertia_kg_m2": round(b[3], 8)}


def build(s, folder):
    lander, motor, booster, aero = s["lander"], s["motor"], s["booster"], s["aero"]
    assert abs(motor["loaded_kg"] - motor["propellant_kg"] - motor["casing"]["kg"]) < 1e-9
    # RocketPy's reference area is pi r^2: this radius (36.996 instead of 37 mm) makes it the reference area.
    radius = math.sqrt(s["reference_area_m2"] / math.pi)
    lander_body = (lander["loaded_kg"], lander["cg_station_m"], lander["pitch_inertia_kg_m2"], lander["roll_inertia_kg_m2"])
    structure = add_up([part(p) for p in booster["parts"]])
    casing = part(motor["casing"])
    m_p, r_p, l_p = motor["propellant_kg"], motor["propellant_radius_m"], motor["propellant_length_m"]
    propellant = (m_p, motor["propellant_station_m"], m_p * (3 * r_p**2 + l_p**2) / 12, m_p * r_p**2 / 2)
    sums = {
        "booster_structure_without_casing": structure,
        "booster_dry_with_casing": add_up([structure, casing]),
        "booster_at_liftoff": add_up([structure, casing, propellant]),
        "stack_at_liftoff": add_up([lander_body, structure, casing, propellant]),
        "stack_at_burnout": add_up([lander_body, structure, casing]),
    }

    nozzle = motor["nozzle_exit_station_m"]
    engine = GenericMotor(
        thrust_source=str(folder / motor["eng"]),
        burn_time=None,  # the curve's
        chamber_radius=r_p, chamber_height=l_p, chamber_position=motor["propellant_station_m"] - nozzle,
        propellant_initial_mass=m_p, nozzle_radius=motor["nozzle_exit_radius_m"],
        dry_mass=casing[0], center_of_dry_mass_position=casing[1] - nozzle, dry_inertia=(casing[2], casing[2], casing[3]),
        nozzle_position=0, interpolation_method="linear", coordinate_system_orientation="nozzle_to_combustion_chamber",
    )
    # RocketPy's rocket is everything but motor casing and propellant; its inertia is about its own centre of mass.
    hull = add_up([lander_body, structure])
    rocket = Rocket(
        radius=radius, mass=hull[0], inertia=(hull[2], hull[2], hull[3]),
        power_off_drag=aero["axial_drag_coefficient"], power_on_drag=aero["axial_drag_coefficient"],
        center_of_mass_without_motor=hull[1], coordinate_system_orientation="tail_to_nose",
    )
    rocket.add_motor(engine, position=nozzle)
    nose = rocket.add_nose(length=aero["nose"]["length_m"], kind=aero["nose"]["kind"], position=lander["nose_tip_station_m"])
    f = aero["fins"]
    fins = rocket.add_trapezoidal_fins(
        n=f["count"], root_chord=f["root_chord_m"], tip_chord=f["tip_chord_m"], span=f["span_m"],
        sweep_length=f["sweep_m"], position=f["root_leading_edge_station_m"],
    )
    rocket.set_rail_buttons(upper_button_position=s["rail"]["upper_button_station_m"], lower_button_position=s["rail"]["lower_button_station_m"])
    return rocket, engine, nose, fins, sums


def barrowman(s, rocket, engine, nose, fins, sums):
    nose_cp = s["lander"]["nose_tip_station_m"] - nose.cp[2]
    fins_cp = s["aero"]["fins"]["root_leading_edge_station_m"] - fins.cp[2]
    out = {
        "reference_area_m2": math.pi * rocket.radius**2,
        "reference_length_m": 2 * rocket.radius,
        "nose": {"cn_alpha_per_rad": nose.clalpha(0), "cp_station_m": nose_cp},
        "fins": {"cn_alpha_per_rad": fins.clalpha(0), "cn_alpha_at_mach_0.1": fins.clalpha(0.1), "cn_alpha_at_mach_0.2": fins.clalpha(0.2), "cp_station_m": fins_cp},
        "roll_damping_cld_omega": fins.roll_parameters[1](0),
    }
    total = nose.clalpha(0) + fins.clalpha(0)
    out["total"] = {"cn_alpha_per_rad": total, "cp_station_m": (nose.clalpha(0) * nose_cp + fins.clalpha(0) * fins_cp) / total}
    out["rocketpy_cp_station_m"] = rocket.cp_position(0)
    d = s["lander"]["diameter_m"]
    out["static_margin_calibres"] = {
        "liftoff": (sums["stack_at_liftoff"][1] - out["total"]["cp_station_m"]) / d,
        "burnout": (sums["stack_at_burnout"][1] - out["total"]["cp_station_m"]) / d,
        "rocketpy_liftoff": rocket.static_margin(0),
        "rocketpy_burnout": rocket.static_margin(engine.burn_out_time),
    }
    return out


def fly(s, rocket, engine, tilt):
    e = s["environment"]
    env = Environment(gravity=e["gravity_m_s2"], elevation=e["elevation_m"], latitude=0.0, longitude=0.0)
    env.set_atmospheric_model(type=e["atmosphere"])
    env.earth_rotation_vector = [0.0, 0.0, 0.0]  # no Coriolis
    flight = Flight(
        rocket=rocket, environment=env, rail_length=s["rail"]["length_m"], inclination=90.0 - tilt, heading=90.0,
        terminate_on_apogee=True, rtol=1e-8, atol=6 * [1e-6] + 4 * [1e-8] + 3 * [1e-6], max_time_step=0.005,
    )

    def axis_tilt(t):
        e1, e2 = flight.e1(t), flight.e2(t)
        return math.degrees(math.acos(max(-1.0, min(1.0, 1 - 2 * (e1 * e1 + e2 * e2)))))

    def state(t):
        vx, vz = flight.vx(t), flight.vz(t)
        return {"t_s": round(t, 4), "z_m": round(flight.z(t), 3), "x_m": round(flight.x(t), 3), "vz_m_s": round(vz, 3),
                "vx_m_s": round(vx, 3), "tilt_deg": round(axis_tilt(t), 3)}

    ta, tb, tr = flight.apogee_time, engine.burn_out_time, flight.out_of_rail_time
    max_speed = max(float(v) for _, v in flight.speed.get_source())
    return {
        "rail_tilt_deg": tilt,
        "effective_rail_m": flight.effective_1rl,
        "rail_exit": {"t_s": tr, "speed_m_s": flight.speed(tr)},
        "burnout": {"t_s": tb, "speed_m_s": flight.speed(tb), "height_m": flight.z(tb)},
        "max_speed_m_s": max_speed,
        "max_mach": flight.max_mach_number,
        "apogee": {"t_s": ta, "height_m": flight.apogee - e["elevation_m"], "horizontal_m": math.hypot(flight.x(ta), flight.y(ta)),
                   "speed_m_s": flight.speed(ta), "tilt_deg": axis_tilt(ta)},
        "tilt_before_apogee_deg": {f"{b}_s": axis_tilt(ta - b) for b in (1, 2, 3)},
        "speed_before_apogee_m_s": {f"{b}_s": flight.speed(ta - b) for b in (1, 2, 3)},
        "table": [state(0.5 * i) for i in range(int(ta / 0.5) + 1)] + [state(ta)],
    }


def main():
    path = Path(sys.argv[1] if len(sys.argv) > 1 else Path(__file__).with_name("stack.json"))
    s = json.loads(path.read_text())
    rocket, engine, nose, fins, sums = build(s, path.parent)
    aero = barrowman(s, rocket, engine, nose, fins, sums)
    weight = sums["stack_at_liftoff"][0] * s["environment"]["gravity_m_s2"]
    result = {
        "rocketpy": version("rocketpy"),
        "convention": "z and x are the travel of the centre of mass without propellant from its place on the rail; tilt is the angle of the body axis from vertical",
        "mass": {k: named(v) for k, v in sums.items()},
        "motor": {"total_impulse_n_s": engine.total_impulse, "burn_s": engine.burn_out_time, "average_thrust_n": engine.average_thrust,
                  "max_thrust_n": engine.max_thrust, "average_thrust_to_weight": engine.average_thrust / weight,
                  "thrust_to_weight_at_0.3_s": engine.thrust(0.3) / weight},
        "aero": aero,
        "flights": [fly(s, rocket, engine, tilt) for tilt in s["rail"]["tilts_deg"]],
    }

    def plain(o):
        if isinstance(o, dict):
            return {k: plain(v) for k, v in o.items()}
        if isinstance(o, list):
            return [plain(v) for v in o]
        return o if isinstance(o, (str, int)) else round(float(o), 6)

    print(json.dumps(plain(result), indent=1))


main()
