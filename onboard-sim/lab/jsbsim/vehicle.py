"""The files of a JSBSim aircraft for one flight of a vehicle: mass, air, legs, servos and the gimballed motor.

Everything comes from the airframe's TOML file, the motor's .eng file and the flight's drawn truth. JSBSim's structural
frame has x aft, y right, z up, with its origin here at the nozzle exit: a station above the nozzle is -x.
"""
import math
import tomllib
from pathlib import Path
from xml.sax.saxutils import escape

LBF_PER_N = 0.22480894244318786
LBF_FT_PER_N_M = 0.7375621492772654
M_PER_FT = 0.3048
KG_M3_PER_SLUG_FT3 = 515.3788183931961
G_M_S2 = 9.80665
LBM_PER_KG = 2.2046226218487757

# Signs of the fins' roll, pitch and yaw moments.
ROLL, PITCH, YAW = [-1, 1, -1, 1], [1, -1, -1, 1], [1, 1, -1, -1]
# Where the legs stand around the axis.
RING = [(1.0, 0.0), (0.0, 1.0), (-1.0, 0.0), (0.0, -1.0)]
STRIPS = 8


def motor(path):
    """Propellant, kg, and the curve of a RASP file: (time s, thrust N) from (0, 0) on."""
    lines = [line for line in Path(path).read_text().splitlines() if line.strip() and not line.startswith(";")]
    propellant_kg = float(lines[0].split()[4])
    curve = [(0.0, 0.0)] + [tuple(map(float, line.split()[:2])) for line in lines[1:]]
    return propellant_kg, curve


def swinging_kg_m2(path):
    """Inertia across its axis of a full motor of a RASP file, a solid cylinder that swings about its middle, kg m^2."""
    lines = [line for line in Path(path).read_text().splitlines() if line.strip() and not line.startswith(";")]
    diameter_m, length_m = (1e-3 * float(word) for word in lines[0].split()[1:3])
    return float(lines[0].split()[5]) * (length_m**2 / 12 + diameter_m**2 / 16)


def thrust_over_burnt(propellant_kg, curve, parts=20):
    """Impulse, N s, and (propellant burnt kg, thrust N). Thrust is proportional to the mass flow."""
    points, impulse = [(0.0, 0.0)], 0.0
    for (t0, f0), (t1, f1) in zip(curve, curve[1:]):
        for part in range(parts):
            a, b = part / parts, (part + 1) / parts
            low, high = f0 + (f1 - f0) * a, f0 + (f1 - f0) * b
            impulse += 0.5 * (low + high) * (t1 - t0) / parts
            points.append((impulse, high))
    scaled = [(propellant_kg * given / impulse, thrust) for given, thrust in points]
    # A motor whose thrust is a function of what has burnt must not begin at nothing: it would never begin. 0.5 N is what
    # the curve has after one millisecond.
    return impulse, [(0.0, 0.5)] + scaled[1:]


def number(value):
    return f"<value>{value!r}</value>"


def prop(name):
    return f"<property>{name}</property>"


def op(kind, *parts):
    return f"<{kind}>{''.join(parts)}</{kind}>"


def fcs(name, body):
    return f'<fcs_function name="{escape(name)}"><function>{body}</function><output>{escape(name)}</output></fcs_function>'


def aerodynamics(airframe, scale):
    """Forces, N, and moments about the nozzle exit, N m, in body axes, as functions of the local wind at each place."""
    body, fins = airframe["body"], airframe["fins"]
    half = 0.5 * scale
    lines = [
        fcs(f"air/{axis}", op("product", number(M_PER_FT), prop(f"velocities/{axis}-aero-fps"))) for axis in "uvw"
    ]
    lines.append(fcs("air/rho", op("product", number(KG_M3_PER_SLUG_FT3), prop("atmosphere/rho-slugs_ft3"))))
    lines.append(fcs("air/cg", op("product", number(-0.0254), prop("inertia/cg-x-in"))))
    p, q, r = (prop(f"velocities/{axis}-rad_sec") for axis in "pqr")
    u, v, w, rho = (prop(f"air/{name}") for name in ("u", "v", "w", "rho"))

    def length(*parts):
        return op("pow", op("sum", *[op("product", part, part) for part in parts]), number(0.5))

    lines.append(fcs("air/speed", length(u, v, w)))
    axial = -half * body["reference_area_m2"] * body["axial_drag_coefficient"]
    lines.append(fcs("air/body/fx", op("product", number(axial), rho, prop("air/speed"), u)))
    forces = {"x": ["air/body/fx"], "y": [], "z": []}
    moments = {"x": [], "y": [], "z": []}

    def local_wind(name, x, y, z):
        """The wind at a place relative to the centre of gravity, and its speed."""
        for axis, base, plus, minus in (
            ("u", u, (q, z), (r, y)), ("v", v, (r, x), (p, z)), ("w", w, (p, y), (q, x)),
        ):
            lines.append(
                fcs(f"{name}/{axis}", op("difference", op("sum", base, op("product", *plus)), op("product", *minus)))
            )
        local = [prop(f"{name}/{axis}") for axis in "uvw"]
        lines.append(fcs(f"{name}/speed", length(*local)))
        return local

    def add_moments(name, station, y, z):
        """The moments of a force about the nozzle exit."""
        fx, fy, fz = (prop(f"{name}/f{axis}") for axis in "xyz")
        for axis, first, second in (
            ("x", (y, fz), (z, fy)), ("y", (z, fx), (station, fz)), ("z", (station, fy), (y, fx)),
        ):
            lines.append(fcs(f"{name}/m{axis}", op("difference", op("product", *first), op("product", *second))))
            moments[axis].append(f"{name}/m{axis}")

    strip_m = body["length_m"] / STRIPS
    across = -half * body["crossflow_drag_coefficient"] * body["diameter_m"] * strip_m
    for i in range(STRIPS):
        station, name = strip_m * (i + 0.5), f"air/strip{i}"
        arm = op("difference", number(station), prop("air/cg"))
        lines.append(fcs(f"{name}/v", op("sum", v, op("product", r, arm))))
        lines.append(fcs(f"{name}/w", op("difference", w, op("product", q, arm))))
        lines.append(fcs(f"{name}/speed", length(prop(f"{name}/v"), prop(f"{name}/w"))))
        for axis, along in (("y", "v"), ("z", "w")):
            force = op("product", number(across), rho, prop(f"{name}/speed"), prop(f"{name}/{along}"))
            lines.append(fcs(f"{name}/f{axis}", force))
            forces[axis].append(f"{name}/f{axis}")
        lines.append(fcs(f"{name}/my", op("product", number(-station), prop(f"{name}/fz"))))
        lines.append(fcs(f"{name}/mz", op("product", number(station), prop(f"{name}/fy"))))
        moments["y"].append(f"{name}/my")
        moments["z"].append(f"{name}/mz")

    # The landing paper's reference area of a fin is that of the body.
    drag = -half * body["reference_area_m2"] * fins["drag_coefficient"]
    lift = -half * body["reference_area_m2"] * fins["lift_coefficient"]
    open_rad = math.radians(fins["from_y_deg"] - fins["hinge_off_deg"])
    for i in range(4):
        name = f"air/fin{i}"
        # Direction from the axis to the open fin.
        out_y, out_z = -YAW[i] * math.cos(open_rad), PITCH[i] * math.sin(open_rad)
        sine = op("sin", prop(f"fcs/fin{i}-rad"))
        lines.append(fcs(f"{name}/sine", sine))
        radius = op(
            "sum", number(0.5 * body["diameter_m"]), op("product", number(0.5 * fins["length_m"]), prop(f"{name}/sine"))
        )
        lines.append(fcs(f"{name}/y", op("product", number(out_y), radius)))
        lines.append(fcs(f"{name}/z", op("product", number(out_z), radius)))
        x = op("difference", number(fins["station_m"]), prop("air/cg"))
        y, z = prop(f"{name}/y"), prop(f"{name}/z")
        lu, lv, lw = local_wind(name, x, y, z)
        lines.append(fcs(f"{name}/drag", op("product", number(drag), rho, prop(f"{name}/sine"), prop(f"{name}/speed"))))
        turned = lift * ROLL[i]
        lines.append(fcs(f"{name}/lift", op("product", number(turned), rho, prop(f"{name}/sine"), prop(f"{name}/speed"))))
        d, l = prop(f"{name}/drag"), prop(f"{name}/lift")
        # Drag along the local wind; lift along (local wind) x (outward), outward = (0, out_y, out_z).
        cross = {
            "x": op("difference", op("product", lv, number(out_z)), op("product", lw, number(out_y))),
            "y": op("product", lu, number(-out_z)),
            "z": op("product", lu, number(out_y)),
        }
        for axis, along in (("x", lu), ("y", lv), ("z", lw)):
            force = op("sum", op("product", d, along), op("product", l, cross[axis]))
            lines.append(fcs(f"{name}/f{axis}", force))
            forces[axis].append(f"{name}/f{axis}")
        add_moments(name, number(fins["station_m"]), y, z)

    legs = airframe["legs"]
    if legs.get("drag_area_m2", 0.0):
        radius_m = 0.5 * (0.5 * body["diameter_m"] + legs["foot_radius_m"])
        drag = number(-half * 0.25 * legs["drag_area_m2"])
        station = number(legs["drag_station_m"])
        for i, (ring_y, ring_z) in enumerate(RING):
            name, y, z = f"air/leg{i}", number(radius_m * ring_y), number(radius_m * ring_z)
            local = local_wind(name, op("difference", station, prop("air/cg")), y, z)
            for axis, along in zip("xyz", local):
                lines.append(fcs(f"{name}/f{axis}", op("product", drag, rho, prop(f"{name}/speed"), along)))
                forces[axis].append(f"{name}/f{axis}")
            add_moments(name, station, y, z)

    axes = []
    for axis, name in (("x", "X"), ("y", "Y"), ("z", "Z")):
        total = op("product", number(LBF_PER_N), op("sum", number(0.0), *map(prop, forces[axis])))
        axes.append(f'<axis name="{name}"><function name="aero/f{axis}-lbs">{total}</function></axis>')
    for axis, name in (("x", "ROLL"), ("y", "PITCH"), ("z", "YAW")):
        total = op("product", number(LBF_FT_PER_N_M), op("sum", number(0.0), *map(prop, moments[axis])))
        axes.append(f'<axis name="{name}"><function name="aero/m{axis}-lbsft">{total}</function></axis>')
    return "".join(lines), "".join(axes)


def servo(name, data, stops_deg):
    """JSBSim's actuator: a delay in frames of a millisecond, a rate limit, stops, and play as hysteresis."""
    low, high = (math.radians(stop) for stop in stops_deg)
    play = math.radians(data.get("slop_deg", 0.0))
    hysteresis = f"<hysteresis_width>{play!r}</hysteresis_width>" if play else ""
    return (
        f'<actuator name="fcs/{name}-rad"><input>fcs/{name}-cmd</input>'
        f'<delay type="frames">{round(1000 * data["delay_s"])}</delay>'
        f'<rate_limit>{math.radians(data["rate_deg_s"])!r}</rate_limit>{hysteresis}'
        f"<clipto><min>{low!r}</min><max>{high!r}</max></clipto></actuator>"
    )


def contact(name, station_m, y_m, z_m, stiffness, damping, friction):
    """z_m in body axes, down."""
    return (
        f'<contact type="STRUCTURE" name="{name}"><location unit="M"><x>{-station_m!r}</x><y>{y_m!r}</y><z>{-z_m!r}</z>'
        f"</location><static_friction>{friction!r}</static_friction><dynamic_friction>{friction!r}</dynamic_friction>"
        f'<spring_coeff unit="N/M">{stiffness!r}</spring_coeff><damping_coeff unit="N/M/SEC">{damping!r}</damping_coeff>'
        "</contact>"
    )


def write(folder, airframe_toml, motor_eng, truth, imu_station_m):
    """Writes the aircraft `vehicle` and its engine and thruster into a folder. The pilot's eye is the inertial unit."""
    airframe = tomllib.loads(Path(airframe_toml).read_text())
    propellant_kg, curve = motor(motor_eng)
    mass, body, legs = airframe["mass"], airframe["body"], airframe["legs"]
    scale = truth["mass_scale"]
    dry_kg = mass["loaded_kg"] - propellant_kg
    loaded = mass["loaded_kg"] * mass["loaded_cg_station_m"]
    cg_m = (loaded - propellant_kg * mass["propellant_station_m"]) / dry_kg
    apart_m = cg_m - mass["propellant_station_m"]
    dry_inertia = mass["loaded_pitch_inertia_kg_m2"] - dry_kg * propellant_kg / mass["loaded_kg"] * apart_m**2
    offset = truth["cg_offset_m"]
    cg = (cg_m + offset[0], offset[1], offset[2])
    impulse, table = thrust_over_burnt(propellant_kg, curve)
    strength = truth["impulse_scale"] / truth["burn_time_scale"]
    # Thrust and flow both with the burn's strength; the scaled propellant is burnt when the scaled impulse is given.
    rows = "\n".join(
        f"{burnt * scale * LBM_PER_KG!r} {thrust * strength * LBF_PER_N!r}" for burnt, thrust in table
    )
    isp_s = truth["impulse_scale"] * impulse / (propellant_kg * scale * G_M_S2)
    system, axes = aerodynamics(airframe, truth["drag_scale"])
    radius = legs["foot_radius_m"]
    feet = [
        contact(f"leg{i}", legs["foot_station_m"], radius * y, radius * z, legs["stiffness_n_m"], legs["damping_n_s_m"],
                legs["friction_coefficient"])
        for i, (y, z) in enumerate(RING)
    ]
    hull = [
        contact(f"{part}{i}", station, 0.5 * body["diameter_m"] * y, 0.5 * body["diameter_m"] * z, 20000.0, 200.0, 0.6)
        for part, station in (("tail", 0.0), ("nose", body["length_m"]))
        for i, (y, z) in enumerate(RING)
    ]
    fins, gimbal = airframe["fins"], airframe["gimbal"]
    stops = (-gimbal["limit_deg"], gimbal["limit_deg"])
    servos = "".join(servo(f"fin{i}", fins["servo"], (fins["closed_deg"], fins["open_deg"])) for i in range(4))
    servos += servo("gimbal-pitch", gimbal["servo"], stops) + servo("gimbal-yaw", gimbal["servo"], stops)
    pitch_off, yaw_off = truth["thrust_misalignment_rad"]
    # Our positive pitch turns the thrust to -z, and positive yaw to +y.
    servos += "".join(
        f'<summer name="fcs/nozzle-{axis}"><input>fcs/gimbal-{axis}-rad</input><bias>{off!r}</bias>'
        f"<output>propulsion/engine[0]/{axis}-angle-rad</output></summer>"
        for axis, off in (("pitch", pitch_off), ("yaw", yaw_off))
    )
    commanded = [f"fin{i}" for i in range(4)] + ["gimbal-pitch", "gimbal-yaw"]
    declared = "".join(f'<property value="0">fcs/{name}-cmd</property>' for name in commanded)
    folder = Path(folder)
    (folder / "aircraft/vehicle").mkdir(parents=True, exist_ok=True)
    (folder / "engine").mkdir(exist_ok=True)
    (folder / "aircraft/vehicle/vehicle.xml").write_text(f"""<?xml version="1.0"?>
<fdm_config name="vehicle" version="2.0" release="PRODUCTION">
<fileheader/>
<metrics>
 <wingarea unit="M2">{body["reference_area_m2"]!r}</wingarea><wingspan unit="M">1</wingspan><chord unit="M">1</chord>
 <location name="AERORP" unit="M"><x>0</x><y>0</y><z>0</z></location>
 <location name="EYEPOINT" unit="M"><x>{-imu_station_m!r}</x><y>0</y><z>0</z></location>
 <location name="VRP" unit="M"><x>0</x><y>0</y><z>0</z></location>
</metrics>
<mass_balance>
 <ixx unit="KG*M2">{mass["roll_inertia_kg_m2"] * scale!r}</ixx>
 <iyy unit="KG*M2">{dry_inertia * scale!r}</iyy><izz unit="KG*M2">{dry_inertia * scale!r}</izz>
 <emptywt unit="KG">{dry_kg * scale!r}</emptywt>
 <location name="CG" unit="M"><x>{-cg[0]!r}</x><y>{cg[1]!r}</y><z>{-cg[2]!r}</z></location>
</mass_balance>
<ground_reactions>{"".join(feet + hull)}</ground_reactions>
<propulsion>
 <engine file="motor"><feed>0</feed>
  <thruster file="nozzle"><location unit="M"><x>{-airframe["gimbal"]["pivot_station_m"]!r}</x><y>0</y><z>0</z></location>
  <orient unit="DEG"><roll>0</roll><pitch>0</pitch><yaw>0</yaw></orient></thruster></engine>
 <tank type="FUEL" number="0"><location unit="M"><x>{-mass["propellant_station_m"]!r}</x><y>0</y><z>0</z></location>
  <capacity unit="KG">{propellant_kg * scale!r}</capacity><contents unit="KG">{propellant_kg * scale!r}</contents></tank>
</propulsion>
<flight_control name="servos">{declared}<channel name="servos">{servos}</channel></flight_control>
<system name="air"><channel name="air">{system}</channel></system>
<aerodynamics>{axes}</aerodynamics>
</fdm_config>
""")
    (folder / "engine/motor.xml").write_text(f"""<?xml version="1.0"?>
<rocket_engine name="motor"><isp>{isp_s!r}</isp><builduptime>0</builduptime>
<maxthrottle>1.0</maxthrottle><minthrottle>0.0</minthrottle><slfuelflowmax>1000</slfuelflowmax>
<thrust_table name="propulsion/thrust_prop_remain" type="internal"><tableData>
{rows}
</tableData></thrust_table></rocket_engine>
""")
    (folder / "engine/nozzle.xml").write_text("""<?xml version="1.0"?>
<nozzle name="nozzle"><area unit="FT2">0.0000001</area></nozzle>
""")
    return airframe
