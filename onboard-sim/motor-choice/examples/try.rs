use std::time::Instant;
use motor_choice::*;
fn main() {
    let a: Vec<String> = std::env::args().collect();
    let mission = vehicles::mission::builtin(&a[1]).unwrap().unwrap();
    let frame = frame::Frame::of(&mission).unwrap();
    let found = if a.len() > 2 { source::read(a[2].as_ref()).unwrap() } else { source::built_in() };
    let t = Instant::now();
    let mut rows = vec![];
    for f in &found {
        let Ok(c) = f else { continue };
        let limits = choice::usual_limits(&mission, &frame, &c.curve, [0.0, 0.3 * mission.airframe.mass.loaded_kg]);
        match choice::choose(&mission, &frame, &c.curve, &limits) {
            Ok(x) => rows.push((x.window.scatter, format!("{:<24} scatter {:.3} m {:.3} ballast {:.3} start {:.0} onset {:.1} v {:.1} heights {:.1}..{:.1} scales {:.3}..{:.3} masses {:.3?}", c.name(), x.window.scatter, x.mass.loaded_kg, x.ballast.mass_kg, x.start_height_m, x.window.onset_m, x.window.speed_m_s, x.window.heights.low_m, x.window.heights.high_m, x.window.impulse_scales[0], x.window.impulse_scales[1], x.landing_kg))),
            Err(e) => if a.len() == 2 || a.len()>3 { println!("{:<24} {e}", c.name()) },
        }
    }
    rows.sort_by(|a, b| b.0.total_cmp(&a.0));
    for r in rows.iter().take(25) { println!("{}", r.1) }
    println!("{} of {} land, {:?}", rows.len(), found.len(), t.elapsed());
}
