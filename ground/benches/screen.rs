//! Measures the cost of drawing a frame and of taking a message into the model.

use std::time::Duration;

use divan::Bencher;
use ground::key::Key;
use ground::model::{Model, Settings};
use ground::update::{Msg, update};
use ground::view::draw;
use ground::view::theme::{Palette, Theme};
use protocol::dialect::{HEARTBEAT_DATA, LOCAL_POSITION_NED_DATA, MavMessage};
use protocol::frame::Encoder;
use protocol::identity::VEHICLE;
use ratatui::Terminal;
use ratatui::backend::TestBackend;

fn main() {
    divan::main();
}

const NOW: Duration = Duration::from_mins(1);

/// Under thrust, with a path behind it.
fn flying() -> Model {
    let mut model = Model::new(Settings::on_screen("udpin:0.0.0.0:14550"));
    let mut encoder = Encoder::new(VEHICLE);
    let heartbeat = HEARTBEAT_DATA { custom_mode: 9, ..HEARTBEAT_DATA::default() };
    let heartbeat = encoder.encode(&MavMessage::HEARTBEAT(heartbeat));
    drop(update(&mut model, Msg::Frame(heartbeat), NOW));
    for point in 0..500_u16 {
        drop(update(&mut model, position(&mut encoder, f32::from(point)), NOW));
    }
    model
}

fn position(encoder: &mut Encoder, point: f32) -> Msg {
    let position = LOCAL_POSITION_NED_DATA { x: point * 0.01, z: point - 500.0, ..Default::default() };
    Msg::Frame(encoder.encode(&MavMessage::LOCAL_POSITION_NED(position)))
}

#[divan::bench(args = ['1', '2', '3', '4', '5', '6', '9', 't'])]
fn frame_80x24(bencher: Bencher, page: char) {
    frame(bencher, page, 80, 24);
}

#[divan::bench(args = ['2', '3'])]
fn frame_300x90(bencher: Bencher, page: char) {
    frame(bencher, page, 300, 90);
}

fn frame(bencher: Bencher, page: char, columns: u16, rows: u16) {
    let mut model = flying();
    drop(update(&mut model, Msg::Keys(vec![Key::Char(page)]), NOW));
    let mut terminal = Terminal::new(TestBackend::new(columns, rows)).expect("memory");
    let theme = Theme { palette: Palette::Dark, ascii: false };
    bencher.bench_local(|| {
        terminal
            .draw(|frame| {
                draw(&model, theme, NOW, frame);
            })
            .map(|drawn| drawn.count)
            .expect("memory")
    });
}

#[divan::bench]
fn message_into_the_model(bencher: Bencher) {
    let mut model = flying();
    let msg = position(&mut Encoder::new(VEHICLE), 3.0);
    bencher.bench_local(|| update(&mut model, msg.clone(), NOW));
}
