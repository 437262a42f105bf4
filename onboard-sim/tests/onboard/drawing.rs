//! The drawing of a vehicle, and that the parts of mk3 fit into it.
#![expect(clippy::unwrap_used, reason = "a test that cannot be set up fails")]

use flight::vehicle::airframe::LEGS_AT;
use flight::vehicle::mission::Mission;
use flight::vehicles::mission::{BUILTIN, builtin};
use onboard_sim::drawing::{Drawing, MK3, read};

fn mission(name: &str) -> Mission {
    builtin(name).unwrap().unwrap()
}

fn mk3(list: &str) -> Drawing {
    Drawing::new(&mission("mk3"), read(list).unwrap())
}

#[test]
fn the_parts_of_mk3_do_not_overlap() {
    assert_eq!(mk3(MK3).overlaps(), [[""; 2]; 0]);
}

#[test]
fn parts_moved_into_each_other_are_found() {
    for (from, to, pair) in [
        // The former positions of computer and parachute.
        ("Flight computer with IMU,box,420,508", "Flight computer with IMU,box,455,545", "Parachute"),
        ("Gimbal ring,tube,97,106", "Gimbal ring,tube,120,129", "Landing motor, swung"),
        ("GNSS antenna and receiver,box,686,694", "GNSS antenna and receiver,box,592,600", "Plate"),
        ("Lidar,box,279.5,300.5,0,45", "Lidar,box,279.5,300.5,0,35", "Body tube"),
        ("Beam of the lidar,disc,-100,279.5,0,45", "Beam of the lidar,disc,-100,279.5,318,318", "Leg 4"),
    ] {
        assert!(MK3.contains(from), "{from}");
        let drawing = mk3(&MK3.replace(from, to));
        let moved = from.split(',').next().unwrap();
        let found = drawing.overlaps();
        let touches = |[one, other]: &[&str; 2]| {
            one.starts_with(pair) && *other == moved || *one == moved && other.starts_with(pair)
        };
        assert!(found.iter().any(touches), "{moved}: {found:?}");
    }
}

/// Where the flight computer corrects for a sensor, there is its part.
#[test]
fn the_sensors_of_mk3_are_in_their_parts() {
    let (drawing, sensors) = (mk3(MK3), mission("mk3").sensors);
    for (part, station_m, [y_m, z_m]) in [
        ("Flight computer with IMU", sensors.imu_station_m, sensors.imu_across_m),
        ("GNSS antenna and receiver", sensors.gnss_station_m, sensors.gnss_across_m),
        ("Lidar", sensors.lidar_station_m, sensors.lidar_across_m),
    ] {
        assert!(drawing.contains(part, [station_m.unwrap(), y_m, z_m]), "{part}");
        assert!(!drawing.contains(part, [station_m.unwrap() - 0.1, y_m, z_m]), "{part}");
    }
    // Fins of carbon hide the sky from what is below their hinges.
    assert!(sensors.gnss_station_m.unwrap() > mission("mk3").airframe.fins.station_m + 0.01);
}

/// The feet of the list are as far from the axis as those of the model, and between them.
#[test]
fn the_feet_of_mk3_stand_between_those_of_the_model() {
    let legs = mission("mk3").airframe.legs;
    let feet = MK3.lines().filter(|line| line.starts_with("Leg") && line.contains(",disc,"));
    let mut found = 0;
    for foot in feet {
        let numbers: Vec<f64> = foot.split(',').filter_map(|cell| cell.parse().ok()).collect();
        let [from_mm, _, y_mm, z_mm, ..] = numbers[..] else { panic!("{foot}") };
        assert!((from_mm - 1e3 * legs.foot_station_m).abs() < 0.1, "{foot}");
        let between = 1e3 * legs.foot_radius_m * std::f64::consts::FRAC_1_SQRT_2;
        assert!((y_mm.abs() - between).abs() < 0.1 && (z_mm.abs() - between).abs() < 0.1, "{foot}");
        found += 1;
    }
    assert_eq!(found, LEGS_AT.len());
}

/// Each part in the list of masses is drawn about the station that its mass has there.
#[test]
fn the_list_of_masses_has_the_stations_of_the_drawing() {
    let page = include_str!("../../../docs/build-mk3.md");
    let table = page.split("\n## Parts\n").nth(1).unwrap().split("\nSums:").next().unwrap();
    let rows = || MK3.lines().filter(|line| !line.starts_with('#')).skip(1);
    let mut compared = 0;
    for row in table.lines().filter(|line| line.starts_with("| ")).skip(1) {
        let cells: Vec<&str> = row.split('|').map(str::trim).collect();
        let station_mm = 1e3 * cells[3].parse::<f64>().unwrap();
        // The name of a row of the page, or its beginning.
        let named = |line: &&str| {
            let name = line.trim_start_matches('"').split(['"', ',']).next().unwrap();
            cells[1].starts_with(name)
        };
        for line in rows().filter(named) {
            let numbers: Vec<f64> = line.split(',').filter_map(|cell| cell.parse().ok()).collect();
            let middle_mm = f64::midpoint(numbers[0], numbers[1]);
            assert!((middle_mm - station_mm).abs() < 1.0, "{row}: {middle_mm} mm");
            compared += 1;
        }
    }
    assert_eq!(compared, 12);
}

#[test]
fn every_vehicle_is_drawn_with_all_its_stations_and_no_label_over_another() {
    for (name, _) in BUILTIN {
        let drawing = if *name == "mk3" { mk3(MK3) } else { Drawing::new(&mission(name), Vec::new()) };
        assert_eq!(drawing.overlaps(), [[""; 2]; 0], "{name}");
        let (svg, labels) = drawing.svg();
        let document = roxmltree::Document::parse(&svg).unwrap();
        let view = document.root_element().attribute("viewBox").unwrap();
        let [_, _, width, height] =
            view.split(' ').map(|n| n.parse::<f64>().unwrap()).collect::<Vec<_>>()[..]
        else {
            panic!("{view}")
        };
        for (at, label) in labels.iter().enumerate() {
            let [left, right, upper, lower] = label.edges_mm();
            assert!(left >= 0.0 && right <= width && upper >= 0.0 && lower <= height, "{name}: {label:?}");
            for other in &labels[at + 1..] {
                let [other_left, other_right, other_upper, other_lower] = other.edges_mm();
                let apart = right <= other_left || other_right <= left;
                assert!(apart || lower <= other_upper || other_lower <= upper, "{name}: {label:?} {other:?}");
            }
        }
        let airframe = mission(name).airframe;
        for station_m in [airframe.body.length_m, airframe.fins.station_m, airframe.gimbal.pivot_station_m] {
            let station = format!("{:.1} ", 1e3 * station_m);
            assert!(labels.iter().any(|label| label.text.contains(&station)), "{name}: {station}");
        }
    }
}

#[test]
fn a_list_that_cannot_be_drawn_is_refused_with_the_part() {
    let refused =
        |row: &str| read(&format!("part,shape,from,to,y,z,a,b,c\n{row}\n")).unwrap_err().to_string();
    for row in [
        "Part,disc,10,5,0,0,20,0,0",
        "Part,disc,0,5,0,nan,20,0,0",
        "Part,tube,0,5,0,0,20,21,0",
        "Part,box,0,5,0,0,20,-1,0",
        "Part,strut,0,5,0,0,20,20,0",
    ] {
        assert!(refused(row).starts_with("Part: its sizes leave no volume; "), "{row}");
    }
    assert!(refused("Part,cube,0,5,0,0,20,21,0").contains("unknown variant `cube`"));
}

/// `UPDATE_PICTURES=1 cargo test -p onboard-sim --test onboard drawing` draws it.
#[test]
fn the_picture_of_the_page_is_drawn_by_the_program() {
    let path = concat!(env!("CARGO_MANIFEST_DIR"), "/../docs/mk3.svg");
    let (svg, _) = mk3(MK3).svg();
    if std::env::var_os("UPDATE_PICTURES").is_some() {
        std::fs::write(path, &svg).unwrap();
    }
    assert!(std::fs::read_to_string(path).unwrap() == svg, "docs/mk3.svg is stale");
}
