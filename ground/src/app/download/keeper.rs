//! The thread that has the files of a download: nothing else waits for the disk.

use std::io;
use std::path::PathBuf;
use std::sync::mpsc::{Receiver, SyncSender, sync_channel};
use std::thread::JoinHandle;

use protocol::ftp::part::Part;

use super::kept::Kept;

/// Most orders that may wait: about a minute of pieces of a radio.
const MAX_WAITING: usize = 1024;
/// Most that the thread has to say: two checksums, and how it ended.
const MAX_TOLD: usize = 4;

enum Order {
    BeginAgain,
    Write { offset: u32, piece: Vec<u8> },
    Remember(Box<Part>),
    Sum,
    Finish,
}

/// What the thread says.
#[derive(Debug)]
pub(super) enum Told {
    /// The checksum of all pieces.
    Sum(u32),
    /// The log has its name.
    Finished(PathBuf),
    Failed(anyhow::Error),
}

/// A handle to the thread.
#[derive(Debug)]
pub(super) struct Keeper {
    orders: Option<SyncSender<Order>>,
    told: Receiver<Told>,
    thread: Option<JoinHandle<()>>,
}

impl Keeper {
    /// Gives the files to a thread of their own.
    ///
    /// # Errors
    /// No thread can be started.
    pub(super) fn start(kept: Kept) -> io::Result<Self> {
        let (orders, inbox) = sync_channel(MAX_WAITING);
        let (tell, told) = sync_channel(MAX_TOLD);
        let thread = std::thread::Builder::new()
            .name("download".to_owned())
            .spawn(move || serve(kept, &inbox, &tell))?;
        Ok(Self { orders: Some(orders), told, thread: Some(thread) })
    }

    pub(super) fn begin_again(&self) {
        self.order(Order::BeginAgain);
    }

    pub(super) fn write(&self, offset: u32, piece: Vec<u8>) {
        self.order(Order::Write { offset, piece });
    }

    pub(super) fn remember(&self, part: Part) {
        self.order(Order::Remember(Box::new(part)));
    }

    /// Asks for the checksum of everything that was written.
    pub(super) fn sum(&self) {
        self.order(Order::Sum);
    }

    /// The log is whole: it gets its name.
    pub(super) fn finish(&self) {
        self.order(Order::Finish);
    }

    /// What the thread has said since.
    pub(super) fn told(&self) -> Option<Told> {
        self.told.try_recv().ok()
    }

    fn order(&self, order: Order) {
        if let Some(orders) = &self.orders {
            // A thread that has ended has said why.
            let _ = orders.send(order);
        }
    }
}

impl Drop for Keeper {
    /// Waits until everything is on disk.
    fn drop(&mut self) {
        self.orders = None;
        if let Some(thread) = self.thread.take() {
            // A panic was printed already.
            let _ = thread.join();
        }
    }
}

fn serve(mut kept: Kept, inbox: &Receiver<Order>, tell: &SyncSender<Told>) {
    while let Ok(order) = inbox.recv() {
        let done = match order {
            Order::BeginAgain => kept.begin_again().map(|()| None),
            Order::Write { offset, piece } => kept.write(offset, &piece).map(|()| None),
            Order::Remember(part) => kept.remember(&part).map(|()| None),
            Order::Sum => kept.checksum().map(|sum| Some(Told::Sum(sum))),
            Order::Finish => {
                // The download may have ended.
                let _ = tell.send(kept.finish().map_or_else(Told::Failed, Told::Finished));
                return;
            }
        };
        match done {
            Ok(None) => {}
            Ok(Some(told)) => drop(tell.send(told)),
            Err(error) => {
                let _ = tell.send(Told::Failed(error.into()));
                return;
            }
        }
    }
}
