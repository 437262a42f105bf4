//! Tests several links: a request over one link applies to that link.

use super::*;

/// A slow link, number 0, and a fast one, number 1.
fn two_links() -> Wire {
    Wire { endpoint: VehicleEndpoint::new().over_links(&[2_000, 20_000]), ..Wire::new() }
}

impl Wire {
    /// What each of two links carried.
    fn run_links(&mut self, duration_s: f64) -> [Vec<Frame>; 2] {
        let end_s = self.vehicle.time_s() + duration_s;
        let mut sent = [Vec::new(), Vec::new()];
        while self.vehicle.time_s() < end_s {
            let (_, leaving) = frame(&mut self.vehicle, &mut self.endpoint, &[]);
            for Outgoing { frame, links } in leaving {
                for link in links {
                    sent[link].push(frame.clone());
                }
            }
        }
        sent
    }

    fn ask_over(&mut self, link: usize, message_id: u32, interval_us: f32) -> u8 {
        let request = CommandRequest {
            source: GROUND,
            target: VEHICLE,
            command: 511,
            params: [message_id as f32, interval_us, 0.0, 0.0, 0.0, 0.0, 0.0],
            confirmation: 0,
        };
        self.endpoint.on_command(link, (&request, None), &self.vehicle);
        self.run_links(0.1)[link].iter().find_map(CommandAnswer::from_frame).unwrap().result
    }
}

fn numbers_are_whole(frames: &[Frame]) -> bool {
    frames.windows(2).all(|pair| pair[1].sequence() == pair[0].sequence().wrapping_add(1))
}

#[test]
fn all_links_carry_copies_until_one_is_asked_for_something_else() {
    let mut wire = two_links();
    let [slow, fast] = wire.run_links(3.0);
    assert_eq!(slow, fast);
    // A request that changes nothing does not split the lane.
    assert_eq!(wire.ask_over(1, ATTITUDE_QUATERNION_DATA::ID, 0.0), 0);
    let [slow, fast] = wire.run_links(1.0);
    assert_eq!(slow, fast);
}

#[test]
fn an_interval_is_for_the_link_that_asked_and_a_fast_link_carries_more() {
    let mut wire = two_links();
    wire.run_links(1.0);
    assert_eq!(wire.ask_over(0, ATTITUDE_QUATERNION_DATA::ID, 20_000.0), MavResult::MAV_RESULT_DENIED as u8);
    assert_eq!(wire.ask_over(1, ATTITUDE_QUATERNION_DATA::ID, 20_000.0), 0);
    let [slow, fast] = wire.run_links(5.0);
    assert!(numbers_are_whole(&slow) && numbers_are_whole(&fast), "a gap would be counted as loss");
    let of = |frames: &[Frame]| count(frames, ATTITUDE_QUATERNION_DATA::ID);
    assert!((39..=41).contains(&of(&slow)), "{} in 5 s at 8 Hz", of(&slow));
    assert!((245..=251).contains(&of(&fast)), "{} in 5 s at 50 Hz", of(&fast));
    // The slow one switches its own off.
    assert_eq!(wire.ask_over(0, ATTITUDE_QUATERNION_DATA::ID, -1.0), 0);
    let [slow, fast] = wire.run_links(1.0);
    assert_eq!((of(&slow), of(&fast) >= 49), (0, true));
}

#[test]
fn texts_of_the_vehicle_go_over_every_link() {
    let mut wire = two_links();
    assert_eq!(wire.ask_over(1, ATTITUDE_QUATERNION_DATA::ID, 20_000.0), 0);
    wire.endpoint.say(Severity::Notice, "a word");
    let sent = wire.run_links(0.1);
    assert!(sent.iter().all(|frames| texts(frames) == ["a word"]));
}
