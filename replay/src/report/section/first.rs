//! The first screen: how the flight ended, what went wrong, the whole flight, its limits and its
//! place.

use flight::rules::verdict::Landing;
use protocol::log::v1::LimitResult;
use protocol::motion::Degrees;
use sim::wire::field::pad_of;

use crate::findings::{Finding, over};
use crate::info::Info;
use crate::log::{Verdict, worst_first};
use crate::report::html::{escaped, paragraph, table};
use crate::report::track::{Flight, State};

use super::{Drawn, place};

pub(super) fn html(flight: &Flight, info: &Info, drawn: &[Drawn]) -> String {
    let height: String =
        drawn.iter().filter(|(section, ..)| *section == "first").map(|(.., svg)| svg.as_str()).collect();
    format!(
        "{}<div class=\"first\"><div>\n<section class=\"found\">{}</section><section class=\"limits\">{}</section></div><div>\n\
         <section class=\"whole\">{height}</section><section class=\"maps\">{}</section><section class=\"moments\">{}</section></div></div>\n",
        verdict(flight, info),
        findings(info, drawn),
        limits(info),
        place::maps(flight),
        place::events_table(flight),
    )
}

/// The ending, the worst limit, the first sign, and the touchdown.
fn verdict(flight: &Flight, info: &Info) -> String {
    let ending = info.ending.as_deref().unwrap_or("No verdict in this log");
    let class = match &info.verdict {
        Some(Verdict { landing: Landing { stands: false, .. }, .. }) => " bad",
        Some(Verdict { landing: Landing { envelope: true, .. }, .. }) => " good",
        // It stands, and its legs were not designed for it.
        Some(_) | None => "",
    };
    let legs = info.verdict.iter().flat_map(Verdict::of_the_legs);
    let (sorted, mut words) = (worst_first(legs), String::new());
    let (all, broken) = (sorted.len(), sorted.iter().filter(|(limit, _)| !limit.passed).count());
    // A limit that allows nothing has no share, and is in the ending.
    if let Some((worst, share)) = sorted.iter().find(|(_, share)| share.is_finite()) {
        let far = if *share > 1.0 { over(*share) } else { format!("{:.0} % of its limit", 100.0 * share) };
        let (name, value) = (&worst.name, measured(worst));
        words.extend([format!(
            "Worst of the legs' limits: {name} {value}, {far}; {broken} of {all} broken. "
        )]);
    }
    if let Some(first) = info.findings.iter().flatten().next() {
        words.extend([format!("First sign: {}, at {:.2}. ", first.words, first.since())]);
    }
    words += &info.verdict.as_ref().and(info.contact()).map_or_else(
        || {
            "The vehicle did not touch down while it was recorded, or its verdict was not recorded."
                .to_owned()
        },
        |contact| {
            let far = |[north_m, east_m, ..]: State| {
                format!(", {:.1} m from the pad", libm::hypot(north_m, east_m))
            };
            let far = flight.contact().map_or_else(String::new, far);
            format!("Touchdown at {}{far}.", info.clocks.words(contact))
        },
    );
    let position = geo_link(flight).unwrap_or_default();
    format!("<h1 class=\"verdict{class}\">{}</h1>\n<p>{}{position}</p>\n", escaped(ending), escaped(&words))
}

/// The touchdown's position as a `geo:` URI (RFC 5870), which a telephone opens in its map.
fn geo_link(flight: &Flight) -> Option<String> {
    let ([north_m, east_m, ..], pad) = (flight.contact()?, pad_of(flight.pilot.as_ref()?.mission()));
    let Degrees { latitude, longitude } = pad.moved(north_m, east_m);
    Some(format!(" <a href=\"geo:{latitude:.6},{longitude:.6}\">{latitude:.6}, {longitude:.6}</a>"))
}

/// The findings, numbered as in the pictures, and below them the picture that shows the first.
fn findings(info: &Info, drawn: &[Drawn]) -> String {
    let mut html = "<h3 id=\"findings\">Findings, causes first</h3>\n".to_owned();
    let Some(findings) = &info.findings else {
        return html + &paragraph(&info.no_findings());
    };
    let of = |picture: &str| drawn.iter().find(|(_, id, svg)| id == picture && !svg.is_empty());
    let item = |finding: &Finding| {
        let Finding { picture, words, .. } = finding;
        let mut words = escaped(words);
        if of(picture).is_some() || ["events", "limits"].contains(picture) {
            words = format!("<a href=\"#{picture}\">{words}</a>");
        }
        format!("<li><b>{:.2}</b> {words}</li>\n", finding.since())
    };
    if findings.is_empty() {
        html += &paragraph(&info.no_findings());
    } else {
        let items: String = findings.iter().map(item).collect();
        html.extend([format!("<ol class=\"findings\">\n{items}</ol>\n")]);
    }
    // The picture of the first finding; the complete flight is drawn beside it.
    let shown = findings.iter().filter_map(|finding| of(finding.picture));
    let first = shown.into_iter().find(|(section, ..)| *section != "first");
    html + &first.map_or_else(String::new, |(.., svg)| svg.replacen("<figure id=", "<figure data-of=", 1))
}

fn limits(info: &Info) -> String {
    let Some(verdict) = &info.verdict else { return String::new() };
    let legs = limit_table("limits of the legs", verdict.of_the_legs());
    let table_2 = limit_table("the paper's Table 2", verdict.table_2.iter());
    format!(
        "<div id=\"limits\">{legs}{table_2}</div><p class=\"note\">Bars: evenly up to the limit, then \u{d7} 10 and \u{d7} 100. Grounds of the \
         pictures: warm under thrust, cool in the fall. Red numbers: the findings.</p>"
    )
}

fn limit_table<'a>(title: &str, limits: impl Iterator<Item = &'a LimitResult>) -> String {
    let row = |(limit, share): (&LimitResult, f64)| {
        let LimitResult { name, minimum, maximum, passed, .. } = limit;
        // A station received them as `f32`.
        let [minimum, maximum] = [minimum, maximum].map(|end| (end * 1e4).round() / 1e4 + 0.0);
        let limit_words = match (minimum < 0.0, (minimum + maximum).abs() < 1e-9) {
            (true, true) => format!("\u{b1}{maximum}"),
            (true, false) => format!("{minimum} to {maximum}"),
            (false, _) => maximum.to_string(),
        };
        let class = if *passed { "good" } else { "bad" };
        let far = match share {
            share if !share.is_finite() => "OUTSIDE".to_owned(),
            share if share < 9.95 => format!("\u{d7} {share:.2}"),
            share => format!("\u{d7} {share:.0}"),
        };
        [
            escaped(name),
            escaped(&measured(limit)),
            limit_words,
            bar(share, *passed),
            format!("<b class=\"{class}\">{far}</b>"),
        ]
    };
    table(&[title, "#value", "#limit", "", "#share"], worst_first(limits).into_iter().map(row))
}

/// A value with its unit; what only happens or does not has none.
fn measured(limit: &LimitResult) -> String {
    let LimitResult { value, minimum, maximum, unit, .. } = limit;
    if maximum <= minimum {
        return if *value == 0.0 { "no" } else { "yes" }.to_owned();
    }
    format!("{:.2} {unit}", value.abs()).trim_end().to_owned()
}

/// A value's share of its limit: even up to the limit, and from there a third of the rest for each
/// factor of ten.
fn bar(share: f64, passed: bool) -> String {
    const LIMIT: f64 = 70.0;
    const TEN: f64 = 25.0;
    let px =
        if share <= 1.0 { LIMIT * share } else { (LIMIT + TEN * libm::log10(share)).min(LIMIT + 2.0 * TEN) };
    let class = if passed { "bar" } else { "barbad" };
    format!(
        "<svg class=\"share\" viewBox=\"0 0 120 14\" aria-hidden=\"true\"><path class=\"room\" d=\"M0 7h120\"/><path class=\"{class}\" \
         d=\"M0 7h{px:.1}\"/><path class=\"mark\" d=\"M{LIMIT} 1v12M95 5v4M119.5 5v4\"/></svg>"
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Far beyond the limit is longer than beyond it, which is longer than at it; a share without
    /// end fills the bar.
    #[test]
    fn bars_of_different_shares_differ() {
        let long = |share: f64| {
            let drawn = bar(share, share <= 1.0);
            let (_, path) = drawn.split_once("d=\"M0 7h120\"/><path class=\"").unwrap();
            let (class, long) = path.split_once("\" d=\"M0 7h").unwrap();
            (class.to_owned(), long.split_once('"').unwrap().0.parse::<f64>().unwrap())
        };
        let shares = [0.0, 0.45, 1.0, 1.9, 36.0, 100.0].map(long);
        assert!(shares.windows(2).all(|pair| pair[1].1 > pair[0].1 + 4.0), "{shares:?}");
        assert_eq!((shares[2].0.as_str(), shares[3].0.as_str()), ("bar", "barbad"));
        assert!((long(f64::INFINITY).1 - shares[5].1).abs() < 1e-9);
    }
}
