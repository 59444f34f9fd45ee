//! A program with outputs of every kind.

use std::fs::OpenOptions;
use std::io::Read;
use std::path::Path;
use std::process::{Command, Stdio};

use tempfile::TempDir;

/// What is behind an output.
#[derive(Copy, Clone, Debug, PartialEq, Eq)]
pub(crate) enum Sink {
    /// Somebody who reads to the end.
    Read,
    /// A pipe whose reader has gone.
    Closed,
    /// A full disk.
    Full,
}

impl Sink {
    fn open(self) -> Stdio {
        match self {
            Self::Read => Stdio::piped(),
            Self::Closed => {
                let (reader, writer) = std::io::pipe().unwrap();
                drop(reader);
                writer.into()
            }
            Self::Full => OpenOptions::new()
                .write(true)
                .open("/dev/full")
                .unwrap()
                .into(),
        }
    }
}

/// What became of it; text where somebody read.
#[derive(Debug)]
pub(crate) struct Ended {
    pub(crate) status: Option<i32>,
    pub(crate) stdout: String,
    pub(crate) stderr: String,
}

/// A command line, in a folder of its own with a temporary directory of its own.
pub(crate) struct Program {
    pub(crate) folder: TempDir,
    command: Command,
}

impl Program {
    /// `coloc` with `arguments`, in which `OUT` stands for the folder.
    pub(crate) fn coloc(arguments: &str) -> Self {
        Self::new(Command::new(env!("CARGO_BIN_EXE_coloc")), arguments)
    }

    pub(crate) fn new(mut command: Command, arguments: &str) -> Self {
        let folder = tempfile::tempdir().unwrap();
        let temporary = folder.path().join("tmp");
        std::fs::create_dir(&temporary).unwrap();
        let out = folder.path().to_str().unwrap().to_owned();
        let arguments = arguments.split_whitespace();
        command.args(arguments.map(|argument| argument.replace("OUT", &out)));
        command
            .env("TMPDIR", temporary)
            .current_dir(folder.path())
            .stdin(Stdio::null());
        Self { folder, command }
    }

    /// Runs it. Whatever happens, it must not have panicked.
    pub(crate) fn run(&mut self, stdout: Sink, stderr: Sink) -> Ended {
        let mut child = self
            .command
            .stdout(stdout.open())
            .stderr(stderr.open())
            .spawn()
            .unwrap();
        // The parent's ends of the pipes go with the next outputs.
        self.command.stdout(Stdio::null()).stderr(Stdio::null());
        let errors = child.stderr.take();
        let read = |mut pipe: Box<dyn Read + Send>| {
            let mut text = String::new();
            pipe.read_to_string(&mut text).unwrap();
            text
        };
        let errors = std::thread::spawn(move || errors.map(|pipe| read(Box::new(pipe))));
        let stdout = child.stdout.take().map(|pipe| read(Box::new(pipe)));
        let ended = Ended {
            stdout: stdout.unwrap_or_default(),
            stderr: errors.join().unwrap().unwrap_or_default(),
            status: child.wait().unwrap().code(),
        };
        assert_ne!(ended.status, Some(101), "{ended:?}");
        assert!(ended.status.is_some(), "ended by a signal: {ended:?}");
        assert!(!ended.stderr.contains("panicked"), "{ended:?}");
        ended
    }

    /// A file in the folder, which must be there and hold something.
    pub(crate) fn assert_wrote(&self, name: &str) {
        let path = self.folder.path().join(name);
        let length = std::fs::metadata(&path).map(|file| file.len());
        assert!(
            length.is_ok_and(|length| length > 0),
            "{name} was not written"
        );
    }

    pub(crate) fn left_in(&self, folder: &Path) -> Vec<String> {
        let entries = std::fs::read_dir(self.folder.path().join(folder)).unwrap();
        entries
            .map(|entry| entry.unwrap().file_name().into_string().unwrap())
            .collect()
    }
}
