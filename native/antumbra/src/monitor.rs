//! The thread-safe window through which a caller watches, stops or cancels a bake.

use std::sync::Mutex;
use std::sync::atomic::{AtomicBool, AtomicU8, Ordering};

use crate::error::Error;
use crate::weld::BakedMesh;

/// What the solver is doing.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Stage {
    /// Validating the scene and building the search tree.
    #[default]
    Preparing,
    /// Finding out which surfaces see each other.
    Linking,
    /// Looking for the shadow boundaries that can be noticed.
    Lines,
    /// Shooting light and refining the mesh.
    Shooting,
    /// Anchoring the mesh and collecting its colours.
    Welding,
    /// Comparing the result with light along random paths.
    Verifying,
    /// The result is ready.
    Done,
}

impl Stage {
    /// A short lower-case English name.
    pub fn name(self) -> &'static str {
        match self {
            Self::Preparing => "preparing",
            Self::Linking => "linking surfaces",
            Self::Lines => "finding shadow boundaries",
            Self::Shooting => "shooting light",
            Self::Welding => "welding",
            Self::Verifying => "verifying",
            Self::Done => "done",
        }
    }
}

/// A snapshot of how far a bake has come.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Progress {
    /// What the solver is doing.
    pub stage: Stage,
    /// Share of the expected work that is done, 0 to 1, over all stages.
    pub fraction: f64,
    /// Shots so far.
    pub shots: usize,
    /// Leaf elements of the mesh.
    pub elements: usize,
    /// Share of the emitted light that has not been distributed yet.
    pub unshot: f64,
}

const RUN: u8 = 0;
const STOP: u8 = 1;
const CANCEL: u8 = 2;

/// Shared between the solving thread and its caller.
#[derive(Debug, Default)]
pub struct Monitor {
    wish: AtomicU8,
    progress: Mutex<Progress>,
    wants_preview: AtomicBool,
    preview: Mutex<Option<Vec<BakedMesh>>>,
}

impl Monitor {
    /// A monitor for one bake.
    pub fn new() -> Self {
        Self::default()
    }

    /// Asks the solver to give up; the bake then returns [`Error::Cancelled`].
    pub fn cancel(&self) {
        self.wish.store(CANCEL, Ordering::Relaxed);
    }

    /// Asks the solver to finish with what it has; the bake is a result like any other.
    pub fn stop(&self) {
        // A cancelled bake stays cancelled.
        let _ = self.wish.compare_exchange(RUN, STOP, Ordering::Relaxed, Ordering::Relaxed);
    }

    /// The latest snapshot.
    ///
    /// # Panics
    /// Never in practice: no code panics while it holds the lock.
    pub fn progress(&self) -> Progress {
        *self.progress.lock().expect("nothing panics under this lock; this is a bug in antumbra")
    }

    /// The mesh and its light as they were at a stage of the bake, each only once; and asks for the next one.
    ///
    /// # Panics
    /// Never in practice: no code panics while it holds the lock.
    pub fn preview(&self) -> Option<Vec<BakedMesh>> {
        self.wants_preview.store(true, Ordering::Relaxed);
        self.preview.lock().expect("nothing panics under this lock; this is a bug in antumbra").take()
    }

    /// Shows what there is when somebody asked for it since the last time.
    pub(crate) fn show(&self, meshes: impl FnOnce() -> Vec<BakedMesh>) {
        if self.wants_preview.swap(false, Ordering::Relaxed) {
            let meshes = meshes();
            *self.preview.lock().expect("nothing panics under this lock; this is a bug in antumbra") =
                Some(meshes);
        }
    }

    pub(crate) fn report(&self, progress: Progress) {
        *self.progress.lock().expect("nothing panics under this lock; this is a bug in antumbra") = progress;
    }

    pub(crate) fn is_cancelled(&self) -> bool {
        self.wish.load(Ordering::Relaxed) == CANCEL
    }

    pub(crate) fn wants_end(&self) -> bool {
        self.wish.load(Ordering::Relaxed) != RUN
    }

    pub(crate) fn check(&self) -> Result<(), Error> {
        if self.is_cancelled() { Err(Error::Cancelled) } else { Ok(()) }
    }
}
