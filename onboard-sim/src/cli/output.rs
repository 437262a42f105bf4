//! Writes the files of a command: each is complete or absent, and replaces an existing one only on request.

use std::fs::File;
use std::io::{BufWriter, Write as _};
use std::path::Path;

use anyhow::Context as _;
use tempfile::NamedTempFile;

/// An existing file is replaced only on request; a pipe or a device has no content that could be lost.
pub(crate) fn refuse_loss(path: &Path, force: bool) -> anyhow::Result<()> {
    let there = path.symlink_metadata().is_ok_and(|found| found.is_file() || found.is_symlink());
    anyhow::ensure!(
        force || is_device(path) || !there,
        "{} exists already; --force replaces it",
        path.display()
    );
    Ok(())
}

fn is_device(path: &Path) -> bool {
    std::fs::metadata(path).is_ok_and(|found| !found.is_file() && !found.is_dir())
}

/// Writes under a hidden temporary name first, so that a file with the final name is always complete.
pub(crate) fn write_file(
    path: &Path,
    force: bool,
    write: impl FnOnce(&mut BufWriter<File>) -> std::io::Result<()>,
) -> anyhow::Result<()> {
    refuse_loss(path, force)?;
    let cannot = || format!("cannot write {}", path.display());
    if is_device(path) {
        let mut out = BufWriter::new(File::options().write(true).open(path).with_context(cannot)?);
        return write(&mut out).and_then(|()| out.flush()).with_context(cannot);
    }
    let unfinished = unfinished_beside(path).with_context(cannot)?;
    fill(&unfinished, write).with_context(cannot)?;
    keep(unfinished, path, force)
}

/// Writes texts as the files of a folder, which is made if it is not there: all of them or none.
pub(crate) fn write_folder(folder: &Path, files: &[(&str, String)], force: bool) -> anyhow::Result<()> {
    for (name, _) in files {
        refuse_loss(&folder.join(name), force)?;
    }
    std::fs::create_dir_all(folder)
        .with_context(|| format!("cannot make the folder {}", folder.display()))?;
    let mut complete = Vec::with_capacity(files.len());
    for (name, text) in files {
        let path = folder.join(name);
        let cannot = || format!("cannot write {}", path.display());
        let unfinished = unfinished_beside(&path).with_context(cannot)?;
        fill(&unfinished, |out| out.write_all(text.as_bytes())).with_context(cannot)?;
        complete.push((unfinished, path));
    }
    complete.into_iter().try_for_each(|(unfinished, path)| keep(unfinished, &path, force))
}

fn fill(
    unfinished: &NamedTempFile,
    write: impl FnOnce(&mut BufWriter<File>) -> std::io::Result<()>,
) -> std::io::Result<()> {
    let mut out = BufWriter::new(unfinished.reopen()?);
    write(&mut out)?;
    out.flush()?;
    out.get_ref().sync_all()
}

fn keep(unfinished: NamedTempFile, path: &Path, force: bool) -> anyhow::Result<()> {
    let kept = if force { unfinished.persist(path) } else { unfinished.persist_noclobber(path) };
    kept.map(drop).map_err(|error| error.error).with_context(|| format!("cannot write {}", path.display()))
}

/// A file that disappears unless it is kept.
fn unfinished_beside(path: &Path) -> std::io::Result<NamedTempFile> {
    let folder = path.parent().filter(|folder| !folder.as_os_str().is_empty()).unwrap_or(Path::new("."));
    let mut unfinished = tempfile::Builder::new();
    unfinished.prefix(".unfinished-");
    #[cfg(unix)]
    {
        use std::os::unix::fs::PermissionsExt as _;
        // The user's umask applies as to any new file; a temporary file would be readable by its owner only.
        unfinished.permissions(std::fs::Permissions::from_mode(0o666));
    }
    unfinished.tempfile_in(folder)
}
