//! Flies some flights and prints what became of them; with one flight, its course.
use campaign::dispersion::Dispersion;
use campaign::draw::draw;
use campaign::fly::Flight;
use flight::mission::Mission;

fn main() {
    let args: Vec<String> = std::env::args().collect();
    let dispersion = Dispersion::builtin(&args[2]).unwrap();
    let mission = match Mission::builtin(&args[1]) {
        Some(m) => m.unwrap(),
        None => Mission::from_toml(&std::fs::read_to_string(&args[1]).unwrap(), &args[1]).unwrap(),
    };
    let (from, to): (u64, u64) = (args[3].parse().unwrap(), args[4].parse().unwrap());
    let trace = to == from + 1;
    let mut count = [0; 2];
    for k in from..to {
        let draw = draw(&mission, &dispersion, 1, k);
        let mut flight = Flight::new(&mission, &dispersion, &draw).unwrap();
        let started = std::time::Instant::now();
        if trace {
            println!("{:?}", draw.truth);
        }
        loop {
            let more = flight.step();
            let f = flight.frame();
            let fine = flight.world().height_m() < 3.0;
            if trace
                && (f % 40 == 0
                    || (flight.pilot().mode().phase.in_landing_burn() && f % 10 == 0)
                    || (fine && f % 4 == 0))
            {
                let w = flight.world();
                let s = w.state();
                let p = flight.pilot();
                let r = p.report();
                let o = p.outlook();
                let e = flight.errors();
                println!(
                    "{:6.2} {:12} h {:7.2} v [{:6.2} {:6.2} {:7.2}] pos [{:6.1} {:6.1}] tilt {:5.1} rate [{:6.1} {:6.1} {:6.1}] fins {:?} gim [{:5.1} {:5.1}] T {:5.1} s {:.3} d {:.3} | {} {} it {} miss {:.3} tf {:.2} tilt {:4.1} td u {:.2} | band {:?} ch {:?} in {:?} | err {:.2} {:.2} {:.2} {:.1}",
                    w.time_s(),
                    p.mode().phase.name(),
                    w.height_m(),
                    s.velocity_m_s.x,
                    s.velocity_m_s.y,
                    s.velocity_m_s.z,
                    s.position_m.x,
                    s.position_m.y,
                    s.tilt_rad().to_degrees(),
                    s.rate_rad_s.x.to_degrees(),
                    s.rate_rad_s.y.to_degrees(),
                    s.rate_rad_s.z.to_degrees(),
                    w.fins_rad().map(|a| a.to_degrees().round() as i32),
                    w.gimbal_rad()[0].to_degrees(),
                    w.gimbal_rad()[1].to_degrees(),
                    w.thrust_n(),
                    p.motor().impulse_scale(),
                    p.motor().burn_time_stretch(),
                    r.level.name(),
                    r.status.name(),
                    r.iterations,
                    r.condition_miss,
                    r.touchdown_in_s,
                    r.largest_tilt_rad.to_degrees(),
                    r.touchdown.u_m_s,
                    o.ignition.band.map(|b| (b.low_m.round(), b.high_m.round())),
                    o.ignition.chosen_m.map(|x| (x * 10.0).round() / 10.0),
                    o.ignition.command_in_s.map(|x| (x * 100.0).round() / 100.0),
                    e.vertical_m_s,
                    e.lateral_m_s,
                    e.height_m,
                    e.nose_rad.to_degrees(),
                );
            }
            if !more {
                break;
            }
        }
        let outcome = flight.outcome();
        count[0] += i32::from(outcome.strict);
        count[1] += i32::from(outcome.legs);
        let t = outcome.touchdown;
        println!(
            "{k:4} {} {} {:?} vz {:6.2} vh {:5.2} tilt {:5.1} rate {:6.1} at {:5.1} imp {:.3} bt {:.3} wind {:.1} rest {:?} phase {} gate {:?} {:?}",
            if outcome.strict { "S" } else { "-" },
            if outcome.legs { "L" } else { "-" },
            outcome.failure.map(|f| f.name()),
            t.map_or(f64::NAN, |t| t.vertical_m_s),
            t.map_or(f64::NAN, |t| t.lateral_m_s),
            t.map_or(f64::NAN, |t| t.tilt_rad.to_degrees()),
            t.map_or(f64::NAN, |t| t.rate_rad_s.to_degrees()),
            t.map_or(f64::NAN, |t| t.state.position_m.xy().norm()),
            draw.truth.impulse_scale,
            draw.truth.burn_time_scale,
            draw.truth.wind_m_s,
            outcome.rest,
            outcome.phase.name(),
            flight.pilot().gate_refusal(),
            started.elapsed(),
        );
    }
    println!("strict {} legs {} of {}", count[0], count[1], to - from);
}
