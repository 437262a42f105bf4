//! The best motors as a picture: how far the thrust of each may be from the certified one.

use core::fmt::{self, Write};

use campaign::picture::{BOTTOM, HEIGHT, LEFT, RIGHT, Scale, TOP, WIDTH, drawn, frame_of_names};

use crate::markup::escaped;
use crate::ranking::{Landing, Ranked};

/// Motors in the picture.
const MOST: usize = 12;
/// Colours of a bar: flown, and not flown. They differ in grey, too.
const COLOURS: [&str; 2] = ["#1b7837", "#a6c8e0"];

/// The first motors of a ranking, as SVG. A bar spans the impulses, over the certified one, that land from one ignition
/// height.
pub fn svg(ranking: &[Ranked], mission: &str) -> String {
    drawn(|out| bars(ranking, mission, out))
}

fn bars(ranking: &[Ranked], mission: &str, out: &mut String) -> fmt::Result {
    let landings: Vec<&Landing> = ranking
        .iter()
        .filter_map(|ranked| if let Ranked::Lands(landing) = ranked { Some(landing) } else { None })
        .take(MOST)
        .collect();
    let mission = escaped(mission);
    if landings.is_empty() {
        return writeln!(out, r#"<text x="{LEFT}" y="24" font-size="14">{mission} lands on no motor</text>"#);
    }
    let (mut from, mut to) = (0.9, 1.1);
    for landing in &landings {
        let [low, high] = landing.choice.window.impulse_scales;
        (from, to) = (f64::min(from, low), f64::max(to, high));
    }
    let room = 0.02 * (to - from);
    let x = Scale { from: from - room, to: to + room, from_px: LEFT, to_px: WIDTH - RIGHT };
    let last = landings.len() as f64 + 0.6;
    let y = Scale { from: last, to: 0.4, from_px: HEIGHT - BOTTOM, to_px: TOP };
    let title = format!("Motors that {mission} lands on");
    frame_of_names(x, y, [&title, "impulse over the certified impulse that still lands", "rank"], out)?;
    for (index, landing) in landings.iter().enumerate() {
        bar(index + 1, landing, [x, y], out)?;
    }
    let one_px = x.px(1.0);
    writeln!(
        out,
        r##"<line x1="{one_px:.1}" y1="{:.1}" x2="{one_px:.1}" y2="{:.1}" stroke="#b2182b" stroke-dasharray="5 3"/>"##,
        y.to_px, y.from_px
    )?;
    for (place, (colour, words)) in COLOURS.into_iter().zip(["flown", "not flown"]).enumerate() {
        let x_px = WIDTH - RIGHT - 150.0 + 65.0 * place as f64;
        writeln!(out, r#"<rect x="{x_px:.1}" y="14" width="12" height="12" fill="{colour}"/>"#)?;
        writeln!(out, r#"<text x="{:.1}" y="24">{words}</text>"#, x_px + 16.0)?;
    }
    Ok(())
}

fn bar(rank: usize, landing: &Landing, [x, y]: [Scale; 2], out: &mut String) -> fmt::Result {
    let choice = &landing.choice;
    let [low, high] = choice.window.impulse_scales;
    let (left_px, right_px, middle_px) = (x.px(low), x.px(high), y.px(rank as f64));
    let height_px = (0.7 * (y.px(1.0) - y.px(0.0))).min(24.0);
    let colour = COLOURS[usize::from(landing.flown.is_none())];
    let name = escaped(&landing.candidate.name());
    writeln!(
        out,
        r#"<rect x="{left_px:.1}" y="{:.1}" width="{:.1}" height="{height_px:.1}" fill="{colour}" fill-opacity="0.55"><title>{name}: {:.3} kg, from {:.0} m, {low:.3} to {high:.3}</title></rect>"#,
        middle_px - 0.5 * height_px,
        right_px - left_px,
        choice.mass.loaded_kg,
        choice.start_height_m
    )?;
    let rate = landing.flown.as_ref().map_or_else(String::new, |flown| {
        format!(", {} of {} land in {}", flown.legs.count, flown.legs.of, escaped(&flown.set))
    });
    let base_px = middle_px + 4.0;
    writeln!(out, r#"<text x="{:.1}" y="{base_px:.1}" text-anchor="end">{rank}</text>"#, x.from_px - 6.0)?;
    writeln!(
        out,
        r#"<text x="{:.1}" y="{base_px:.1}" font-size="11">{name}, {:.2} kg from {:.0} m{rate}</text>"#,
        left_px + 4.0,
        choice.mass.loaded_kg,
        choice.start_height_m
    )
}
