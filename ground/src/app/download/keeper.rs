//! The thread that has the files of a download. Nothing else waits for the disk: a disk that hangs must not hold up an abort.

use std::io;
use std::path::PathBuf;
use std::sync::mpsc::{Receiver, SyncSender, TrySendError, sync_channel};
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

/// The disk does not keep up: what has arrived is lost.
#[derive(Debug, thiserror::Error)]
#[error("the disk does not keep up with the link; the next download goes on with what is there")]
pub(super) struct Behind;

/// A handle to the thread. Without it the thread does what it was told, and ends.
#[derive(Debug)]
pub(super) struct Keeper {
    orders: SyncSender<Order>,
    told: Receiver<Told>,
    thread: JoinHandle<()>,
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
        Ok(Self { orders, told, thread })
    }

    pub(super) fn begin_again(&self) -> Result<(), Behind> {
        self.order(Order::BeginAgain)
    }

    pub(super) fn write(&self, offset: u32, piece: Vec<u8>) -> Result<(), Behind> {
        self.order(Order::Write { offset, piece })
    }

    pub(super) fn remember(&self, part: Part) -> Result<(), Behind> {
        self.order(Order::Remember(Box::new(part)))
    }

    /// Asks for the checksum of everything that was written.
    pub(super) fn sum(&self) -> Result<(), Behind> {
        self.order(Order::Sum)
    }

    /// The log is whole: it gets its name.
    pub(super) fn finish(&self) -> Result<(), Behind> {
        self.order(Order::Finish)
    }

    /// What the thread has said since.
    pub(super) fn told(&self) -> Option<Told> {
        self.told.try_recv().ok()
    }

    /// Waits until everything is on disk, for a program that ends.
    pub(super) fn close(self) {
        drop(self.orders);
        // A panic was printed already.
        let _ = self.thread.join();
    }

    fn order(&self, order: Order) -> Result<(), Behind> {
        match self.orders.try_send(order) {
            // A thread that has ended has said why.
            Ok(()) | Err(TrySendError::Disconnected(_)) => Ok(()),
            Err(TrySendError::Full(_)) => Err(Behind),
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

#[cfg(test)]
mod tests {
    use super::*;

    /// The thread is not there to take anything: as with a disk that hangs.
    #[test]
    fn a_disk_that_hangs_fails_the_download_and_holds_nothing_up() {
        let (orders, _inbox) = sync_channel(2);
        let (_tell, told) = sync_channel(1);
        let thread = std::thread::Builder::new().name("idle".to_owned()).spawn(|| {}).unwrap();
        let keeper = Keeper { orders, told, thread };
        assert!(keeper.write(0, vec![1]).is_ok() && keeper.write(1, vec![2]).is_ok());
        assert!(keeper.write(2, vec![3]).unwrap_err().to_string().contains("does not keep up"));
    }
}
