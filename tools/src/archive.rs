//! Zip archives with reproducible bytes. The only file of the tools that knows the zip crate.

use std::collections::BTreeMap;
use std::fs::{self, File};
use std::io::{Cursor, Read, Write};
use std::path::{Path, PathBuf};

use anyhow::{Context, Result, ensure};
use zip::write::SimpleFileOptions;
use zip::{CompressionMethod, DateTime, ZipArchive, ZipWriter};

/// Files by their path inside of the archive, with forward slashes; sorted, so that the order of adding does not show.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Files(BTreeMap<String, Vec<u8>>);

impl Files {
    /// Adds a file. The same path twice is an error, because one of the two would vanish.
    pub fn add(&mut self, path: &str, bytes: impl Into<Vec<u8>>) -> Result<()> {
        let earlier = self.0.insert(path.to_owned(), bytes.into());
        ensure!(earlier.is_none(), "{path} is in the archive twice");
        Ok(())
    }

    /// Adds all files below a folder of the disk. A folder that does not exist has no files.
    pub fn add_folder(&mut self, prefix: &str, folder: &Path) -> Result<()> {
        if !folder.is_dir() {
            return Ok(());
        }
        for entry in fs::read_dir(folder).with_context(|| format!("reading {}", folder.display()))? {
            let entry = entry?;
            let name = entry.file_name();
            let name = name.to_str().with_context(|| format!("{} is not valid UTF-8", entry.path().display()))?;
            let path = format!("{prefix}/{name}");
            if entry.file_type()?.is_dir() {
                self.add_folder(&path, &entry.path())?;
            } else {
                self.add(&path, read(&entry.path())?)?;
            }
        }
        Ok(())
    }

    /// One file's bytes.
    pub fn get(&self, path: &str) -> Option<&[u8]> {
        self.0.get(path).map(Vec::as_slice)
    }

    /// All files in the order of the archive.
    pub fn iter(&self) -> impl Iterator<Item = (&str, &[u8])> {
        self.0.iter().map(|(path, bytes)| (path.as_str(), bytes.as_slice()))
    }

    /// Reads an archive.
    pub fn open(archive: &Path) -> Result<Self> {
        let file = File::open(archive).with_context(|| format!("opening {}", archive.display()))?;
        let mut zip = ZipArchive::new(file).with_context(|| format!("{} is not a zip archive", archive.display()))?;
        let mut files = Self::default();
        for index in 0..zip.len() {
            let mut entry = zip.by_index(index)?;
            if entry.is_dir() {
                continue;
            }
            // A hostile name such as "../../x" must not leave the folder that `extract` writes to.
            let path = entry
                .enclosed_name()
                .with_context(|| format!("{} has an unsafe name in it", archive.display()))?
                .to_string_lossy()
                .replace('\\', "/");
            let mut bytes = Vec::new();
            entry.read_to_end(&mut bytes)?;
            files.add(&path, bytes)?;
        }
        Ok(files)
    }

    /// Writes all files below a folder.
    pub fn extract(&self, folder: &Path) -> Result<()> {
        for (path, bytes) in self.iter() {
            let target = folder.join(path);
            if let Some(parent) = target.parent() {
                fs::create_dir_all(parent)?;
            }
            fs::write(&target, bytes).with_context(|| format!("writing {}", target.display()))?;
        }
        Ok(())
    }

    /// The archive's bytes: the same files give the same bytes, whatever the clock says.
    pub fn to_bytes(&self) -> Result<Vec<u8>> {
        let mut zip = ZipWriter::new(Cursor::new(Vec::new()));
        for (path, bytes) in self.iter() {
            // A library needs its execute bit on systems that keep one; Windows ignores it.
            let mode = if path.starts_with("binaries/") { 0o755 } else { 0o644 };
            let options = SimpleFileOptions::default()
                .compression_method(CompressionMethod::Deflated)
                .last_modified_time(DateTime::default())
                .unix_permissions(mode);
            zip.start_file(path, options)?;
            zip.write_all(bytes)?;
        }
        Ok(zip.finish()?.into_inner())
    }

    /// Writes the archive to a temporary file beside the target and renames it: nobody ever sees half of one.
    pub fn save(&self, archive: &Path) -> Result<PathBuf> {
        write_whole(archive, &self.to_bytes()?)?;
        Ok(archive.to_path_buf())
    }
}

/// Refuses a file that [`write_whole`] could not write, before hours are spent on what is to stand in it.
pub fn writable(path: &Path) -> Result<()> {
    ensure!(!path.is_dir(), "{} is a folder: name a file in it", path.display());
    let folder = path.parent().unwrap_or_else(|| Path::new("."));
    fs::create_dir_all(folder).with_context(|| format!("creating {}", folder.display()))?;
    tempfile::NamedTempFile::new_in(folder).with_context(|| format!("{} cannot be written", path.display()))?;
    Ok(())
}

/// Writes a file in one go: under a temporary name first, then renamed.
pub fn write_whole(path: &Path, bytes: &[u8]) -> Result<()> {
    let folder = path.parent().unwrap_or_else(|| Path::new("."));
    fs::create_dir_all(folder).with_context(|| format!("creating {}", folder.display()))?;
    let mut file =
        tempfile::NamedTempFile::new_in(folder).with_context(|| format!("writing into {}", folder.display()))?;
    file.write_all(bytes)?;
    make_readable(file.as_file())?;
    // The error of `persist` and its source say the same.
    file.persist(path).map_err(|error| error.error).with_context(|| format!("writing {}", path.display()))?;
    Ok(())
}

/// Temporary files are private to their owner; a finished one is for everybody.
#[cfg(unix)]
fn make_readable(file: &File) -> Result<()> {
    use std::os::unix::fs::PermissionsExt;
    file.set_permissions(fs::Permissions::from_mode(0o644))?;
    Ok(())
}

#[cfg(not(unix))]
fn make_readable(_file: &File) -> Result<()> {
    Ok(())
}

/// Reads a file, naming it when that fails.
pub fn read(path: &Path) -> Result<Vec<u8>> {
    fs::read(path).with_context(|| format!("reading {}", path.display()))
}

/// Reads a text file, naming it when that fails.
pub fn read_text(path: &Path) -> Result<String> {
    fs::read_to_string(path).with_context(|| format!("reading {}", path.display()))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn sample() -> Files {
        let mut files = Files::default();
        files.add("resources/b.txt", "b").unwrap();
        files.add("binaries/linux64/a.so", vec![0_u8; 5000]).unwrap();
        files
    }

    #[test]
    fn the_bytes_do_not_depend_on_the_order_of_adding() {
        let mut other = Files::default();
        other.add("binaries/linux64/a.so", vec![0_u8; 5000]).unwrap();
        other.add("resources/b.txt", "b").unwrap();
        assert_eq!(sample().to_bytes().unwrap(), other.to_bytes().unwrap());
    }

    #[test]
    fn an_archive_reads_back_as_it_was_written() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("new/x.fmu");
        sample().save(&path).unwrap();
        assert_eq!(Files::open(&path).unwrap(), sample());
        // The temporary file is gone: the archive is alone in its folder.
        assert_eq!(fs::read_dir(path.parent().unwrap()).unwrap().count(), 1);
    }

    #[test]
    fn what_cannot_be_written_is_refused_before() {
        let folder = tempfile::tempdir().unwrap();
        writable(&folder.path().join("new/x.csv")).unwrap();
        assert_eq!(fs::read_dir(folder.path().join("new")).unwrap().count(), 0, "nothing is left behind");
        let message = format!("{:#}", writable(folder.path()).unwrap_err());
        assert!(message.ends_with(" is a folder: name a file in it"), "{message}");
        fs::write(folder.path().join("file"), "").unwrap();
        assert!(writable(&folder.path().join("file/x.csv")).is_err());
    }

    #[test]
    fn a_path_cannot_be_added_twice() {
        let error = sample().add("resources/b.txt", "c").unwrap_err();
        assert_eq!(error.to_string(), "resources/b.txt is in the archive twice");
    }

    #[test]
    fn a_name_that_leaves_the_folder_is_refused() {
        let mut zip = ZipWriter::new(Cursor::new(Vec::new()));
        zip.start_file("../evil", SimpleFileOptions::default()).unwrap();
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("x.fmu");
        fs::write(&path, zip.finish().unwrap().into_inner()).unwrap();
        assert!(Files::open(&path).is_err());
    }
}
