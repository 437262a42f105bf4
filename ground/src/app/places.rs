//! The files with the last place of a vehicle, beside the log: one GeoJSON and one KML for each boot of a vehicle.

use std::fs::{self, File};
use std::io::{Read as _, Write as _};
use std::path::Path;

use anyhow::Context as _;

use crate::model::place::LastPlace;
use crate::place_file;

/// What the names of the files begin with; the vehicle's boot number follows.
const NAME: &str = "touchdown-place-";
/// Older places are of no use to somebody who looks for a vehicle today.
const KEPT_FOR_S: u64 = 24 * 3_600;
/// Longer files are none of ours.
const BYTES_MAX: u64 = 64 * 1024;

/// Writes both files. A file gets its name when it is complete, so a crash leaves the former place.
///
/// # Errors
/// The folder cannot be written.
pub(super) fn write(folder: &Path, place: &LastPlace) -> anyhow::Result<()> {
    let name = format!("{NAME}{:08X}", place.boot);
    write_one(folder, &format!("{name}.geojson"), &place_file::geojson(place))?;
    match place_file::kml(place) {
        Some(kml) => write_one(folder, &format!("{name}.kml"), &kml),
        None => Ok(()),
    }
}

fn write_one(folder: &Path, name: &str, text: &str) -> anyhow::Result<()> {
    let (part, whole) = (folder.join(format!("{name}.part")), folder.join(name));
    let failed = || format!("writing {}", whole.display());
    let mut file = File::create(&part).with_context(failed)?;
    file.write_all(text.as_bytes()).with_context(failed)?;
    fs::rename(&part, &whole).with_context(failed)
}

/// The newest place that was kept in the folder of the log in the last day.
pub(super) fn newest(folder: Option<&Path>, now_unix_s: u64) -> Option<LastPlace> {
    let folder = match folder? {
        here if here.as_os_str().is_empty() => Path::new("."),
        folder => folder,
    };
    let files = fs::read_dir(folder).ok()?.filter_map(Result::ok);
    let ours = files.filter(|file| {
        let name = file.file_name();
        let name = name.to_string_lossy();
        name.starts_with(NAME) && Path::new(&*name).extension().is_some_and(|ending| ending == "geojson")
    });
    let places = ours.filter_map(|file| {
        let mut text = String::new();
        File::open(file.path()).ok()?.take(BYTES_MAX).read_to_string(&mut text).ok()?;
        place_file::read(&text)
    });
    places
        .filter(|place| now_unix_s.saturating_sub(place.heard_unix_s) <= KEPT_FOR_S)
        .max_by_key(|place| place.heard_unix_s)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::model::place::{Degrees, Spot};

    #[test]
    fn the_newest_place_of_today_survives_a_restart() {
        let folder = tempfile::tempdir().unwrap();
        let now = 1_800_000_000;
        let place = |boot, heard_unix_s| LastPlace {
            boot,
            heard_unix_s,
            heard: Spot { north_m: 1.0, east_m: 2.0, error_m: 3.0 },
            height_m: 4.0,
            predicted: None,
            pad: Some(Degrees { latitude: 35.0, longitude: -117.0 }),
        };
        assert_eq!(newest(Some(folder.path()), now), None);
        for (boot, heard) in [(1, now - 100), (2, now - 50), (3, now - 2 * KEPT_FOR_S)] {
            write(folder.path(), &place(boot, heard)).unwrap();
        }
        // The place of a vehicle is written again and again.
        write(folder.path(), &place(2, now - 10)).unwrap();
        fs::write(folder.path().join(format!("{NAME}broken.geojson")), "{").unwrap();
        assert_eq!(newest(Some(folder.path()), now), Some(place(2, now - 10)));
        let kml = fs::read_to_string(folder.path().join(format!("{NAME}00000002.kml"))).unwrap();
        assert!(kml.contains("<name>last heard</name>"));
        let parts = fs::read_dir(folder.path()).unwrap().filter_map(Result::ok);
        assert_eq!(parts.filter(|file| file.path().extension().is_some_and(|end| end == "part")).count(), 0);
    }
}
