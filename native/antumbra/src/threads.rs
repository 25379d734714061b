//! The threads that bake.

use rayon::{ThreadPool, ThreadPoolBuilder};
use thread_priority::{ThreadPriority, set_current_thread_priority};

use crate::error::Error;

/// Of 100, where 50 is usual. On Linux a niceness of 11, with which a thread gets a twelfth of the time of another that wants to
/// run on the same core.
const PRIORITY: u8 = 20;

/// How much a thread takes at a time of work whose parts take long: of places that look around, of faces, of clusters. Left to
/// itself rayon halves what another thread took over only once or twice more, and who is done can but watch: in a bake of two
/// minutes on two cores one of them did so for eight seconds.
pub(crate) const AT_A_TIME: usize = 16;

/// As many threads as asked for, or one for each core. They give way to the one that draws the window of who waits for them.
///
/// # Errors
/// [`Error::Threads`] where the system gives none.
pub(crate) fn pool(threads: usize) -> Result<ThreadPool, Error> {
    let pool = ThreadPoolBuilder::new().num_threads(threads).start_handler(|_| give_way());
    pool.build().map_err(|error| Error::Threads { reason: error.to_string() })
}

fn give_way() {
    let priority = ThreadPriority::try_from(PRIORITY).expect("it is one; this is a bug in antumbra");
    // Where the system does not let it, or has it lower already, the bake is the same.
    let _ = set_current_thread_priority(priority);
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The 19th field (`proc_pid_stat(5)`).
    #[cfg(target_os = "linux")]
    fn niceness() -> i32 {
        let stat = std::fs::read_to_string("/proc/thread-self/stat").expect("Linux tells");
        let after_name = stat.rsplit(')').next().expect("there is a rest");
        after_name.split_whitespace().nth(16).and_then(|field| field.parse().ok()).expect("a number")
    }

    #[cfg(target_os = "linux")]
    #[test]
    fn threads_that_bake_give_way_and_the_one_that_asks_does_not() {
        let before = niceness();
        assert!(pool(2).expect("two threads").install(niceness) >= 10);
        assert_eq!(niceness(), before);
    }
}
