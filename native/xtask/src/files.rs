//! Files: copying folders, and stamps that tell whether a step must be done again.

use std::collections::hash_map::DefaultHasher;
use std::fs;
use std::hash::{Hash, Hasher};
use std::path::{Path, PathBuf};

use crate::failure::{Failure, Outcome};

/// Every file below a folder in a fixed order, without what Python leaves behind.
pub(crate) fn below(folder: &Path) -> Outcome<Vec<PathBuf>> {
    let mut files = Vec::new();
    let mut folders = vec![folder.to_owned()];
    while let Some(folder) = folders.pop() {
        for entry in fs::read_dir(&folder).map_err(Failure::file(&folder))? {
            let path = entry.map_err(Failure::file(&folder))?.path();
            let name = path.file_name().unwrap_or_default();
            if path.is_dir() {
                if name != "__pycache__" {
                    folders.push(path);
                }
            } else if path.extension().is_none_or(|extension| extension != "pyc") {
                files.push(path);
            }
        }
    }
    files.sort();
    Ok(files)
}

/// Makes `to` an exact copy of `from`.
pub(crate) fn mirror(from: &Path, to: &Path) -> Outcome {
    remove_folder(to)?;
    for file in below(from)? {
        let relative = file.strip_prefix(from).expect("it lies below the folder; this is a bug in xtask");
        copy(&file, &to.join(relative))?;
    }
    Ok(())
}

/// Copies one file and makes its folder.
pub(crate) fn copy(from: &Path, to: &Path) -> Outcome {
    make_parent(to)?;
    fs::copy(from, to).map_err(Failure::file(from))?;
    Ok(())
}

/// Makes the folder that a file will lie in.
pub(crate) fn make_parent(file: &Path) -> Outcome {
    let folder = file.parent().unwrap_or(file);
    fs::create_dir_all(folder).map_err(Failure::file(folder))
}

/// Removes a folder, if it is there.
pub(crate) fn remove_folder(folder: &Path) -> Outcome {
    if folder.exists() {
        fs::remove_dir_all(folder).map_err(Failure::file(folder))?;
    }
    Ok(())
}

/// Reads a text file.
pub(crate) fn read(path: &Path) -> Outcome<String> {
    fs::read_to_string(path).map_err(Failure::file(path))
}

/// Writes a text file and makes its folder.
pub(crate) fn write(path: &Path, text: &str) -> Outcome {
    make_parent(path)?;
    fs::write(path, text).map_err(Failure::file(path))
}

/// A number that changes when any of the files does. For stamps of this machine only: another Rust may count
/// differently, which costs no more than doing a step again.
pub(crate) fn digest(files: &[PathBuf]) -> Outcome<String> {
    let mut hasher = DefaultHasher::new();
    for file in files {
        file.hash(&mut hasher);
        fs::read(file).map_err(Failure::file(file))?.hash(&mut hasher);
    }
    Ok(format!("{:016x}", hasher.finish()))
}

/// Does `work` unless the stamp file says that it was done for the same `state`.
pub(crate) fn unless_stamped(stamp: &Path, state: &str, work: impl FnOnce() -> Outcome) -> Outcome {
    if fs::read_to_string(stamp).is_ok_and(|stamped| stamped == state) {
        return Ok(());
    }
    work()?;
    write(stamp, state)
}
