//! The unmodified release image on an emulated STM32F405.
//!
//! [`Emulator::boot`] starts QEMU with the CPU held in reset, serves the clock registers that QEMU
//! does not model until the image reports that its start-up is over, and lets it run. From then on
//! the image has a serial port like any board: [`Emulator::serial_port`].
//!
//! The driver itself keeps the serial port open, so a client may come (and come back) whenever it
//! likes: what the image has printed waits for it, up to the few KiB that the kernel buffers, and
//! the board stands still when that is full. Virtual time has no fixed relation to wall-clock time;
//! the baud rate is not emulated.

mod access;
mod boot;
pub mod clock_cover;
pub mod cycles;
mod error;
mod image;
pub mod interrupt_cost;
pub mod masked_sections;
pub mod panic_site;
mod process;
pub mod rsp;
mod serial;
pub mod stack;
mod stall;
pub mod stand_in;
pub mod thumb;
mod tick_alignment;
pub mod unmodelled;
mod version;

use std::io::{Read, Write};
use std::os::unix::net::UnixStream;
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

pub use boot::BootReport;
pub use error::EmulatorError;
pub use image::{BOOT_COMPLETE_SYMBOL, function_address, static_address};
pub use version::{OLDEST_MAJOR, QemuVersion};

use boot::{BootFailure, Circumstances};
use clock_cover::ClockCover;
use image::ImageSymbols;
use process::QemuProcess;
use rsp::{RspClient, RspError};
use serial::HeldSerial;
use stack::StackRegion;
use tempfile::TempDir;
use unmodelled::Listener;

/// For how long a test waits until a motion in the emulator has come to rest. A motion takes seconds, on a
/// computer that is busy with other emulators minutes; the limit is there for an emulator that hangs.
pub const REST_LIMIT: Duration = Duration::from_secs(300);

/// How to run the emulator.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct EmulatorOptions {
    /// The program; found on the search path by default.
    pub qemu: PathBuf,
    /// An instruction takes 2^shift ns of virtual time, and a tick at 4 kHz 20.999 us of it (see
    /// `tick_alignment`): with 2, the default, 5250 instructions. The tick, the console and a stream
    /// of every fourth sample fit into that with room to spare, and barely into the 2625 of 3. A larger
    /// shift is no faster where the image sleeps between ticks, for sleep is skipped.
    pub shift: u8,
    /// Wall-clock limit for QEMU to open its debug link and serial port.
    pub start_limit: Duration,
    /// Wall-clock limit for the image's start-up.
    pub boot_limit: Duration,
    /// Leaves the core stopped at the end of its start-up, for who stands in for something from there on.
    pub held: bool,
    /// What the flash holds beside the image: from an address on, these bytes. It is zero otherwise.
    pub flash: Vec<(u32, Vec<u8>)>,
}

impl Default for EmulatorOptions {
    fn default() -> Self {
        Self {
            qemu: PathBuf::from("qemu-system-arm"),
            shift: 2,
            start_limit: Duration::from_secs(10),
            boot_limit: Duration::from_secs(20),
            held: false,
            flash: Vec::new(),
        }
    }
}

/// A running board. Dropping it ends the emulator.
#[derive(Debug)]
pub struct Emulator {
    // Fields drop in this order: the process ends before its terminal and directory go.
    process: QemuProcess,
    serial: HeldSerial,
    report: BootReport,
    version: QemuVersion,
    gdb: PathBuf,
    stack: StackRegion,
    symbols: ImageSymbols,
    /// The virtual time of the last reset, in ns.
    reset_at: u32,
    /// [`EmulatorOptions::shift`] and [`EmulatorOptions::held`].
    shift: u8,
    held: bool,
    _directory: TempDir,
}

impl Emulator {
    /// Boots an image (an ELF file with the function [`BOOT_COMPLETE_SYMBOL`]).
    ///
    /// # Errors
    ///
    /// [`EmulatorError`], each with what to do about it: no emulator or an old one, not an image,
    /// a start-up that does not end, an access that cannot be served.
    pub fn boot(image: &Path, options: &EmulatorOptions) -> Result<Self, EmulatorError> {
        Self::boot_heard(image, options, None)
    }

    /// The same, telling `listener` of every access to what the emulator does not model, from the first
    /// instruction on.
    ///
    /// # Errors
    ///
    /// As [`Self::boot`].
    pub fn boot_heard_by(
        image: &Path,
        options: &EmulatorOptions,
        listener: Listener,
    ) -> Result<Self, EmulatorError> {
        Self::boot_heard(image, options, Some(listener))
    }

    fn boot_heard(
        image: &Path,
        options: &EmulatorOptions,
        listener: Option<Listener>,
    ) -> Result<Self, EmulatorError> {
        let symbols = ImageSymbols::read(image)?;
        let stack = StackRegion::read(image)?;
        let version = version::check(&options.qemu)?;
        let directory = tempfile::Builder::new()
            .prefix("stillbeam-emulator-")
            .tempdir()
            .map_err(|source| EmulatorError::system("making a temporary directory", source))?;
        let gdb = directory.path().join("gdb");
        let terminal = directory.path().join("serial");
        let mut process =
            start(image, options, [&gdb, &terminal, &directory.path().join("output")], listener)?;
        let deadline = Instant::now() + options.start_limit;
        let serial = wait_for(&mut process, deadline, "its serial port", || HeldSerial::open(&terminal))?;
        let link = wait_for(&mut process, deadline, "its debug link", || connect(&gdb))?;
        let mut client = RspClient::new(link);
        let report = stack
            .paint(&mut client)
            .and_then(|()| tick_alignment::start_clock(&mut client))
            .and_then(|()| {
                options.flash.iter().try_for_each(|(address, bytes)| client.write_block(*address, bytes))
            })
            .map_err(BootFailure::Link)
            .and_then(|()| {
                let circumstances = Circumstances { held: options.held, ..Circumstances::default() };
                boot::boot(client, &symbols, circumstances, options.boot_limit)
            })
            .map_err(|failure| match failure {
                BootFailure::Emulator(error) => error,
                BootFailure::Link(source) => EmulatorError::Link { source, output: process.output() },
            })?;
        let EmulatorOptions { shift, held, .. } = *options;
        Ok(Self {
            process,
            serial,
            report,
            version,
            gdb,
            stack,
            symbols,
            reset_at: 0,
            shift,
            held,
            _directory: directory,
        })
    }

    /// The pseudo-terminal that is the board's serial port; open it like any serial port.
    pub fn serial_port(&self) -> &Path {
        self.serial.path()
    }

    /// Stops the CPU and returns a debugger's link to it; [`RspClient::detach`] lets it run on.
    ///
    /// # Errors
    ///
    /// [`EmulatorError::Process`] where the emulator does not accept the link.
    pub fn debug(&mut self) -> Result<RspClient<UnixStream>, EmulatorError> {
        let deadline = Instant::now() + Duration::from_secs(5);
        let stream = wait_for(&mut self.process, deadline, "its debug link", || connect(&self.gdb))?;
        Ok(RspClient::new(stream))
    }

    /// Resets the board and runs its start-up again. Main memory outlives it but for what start-up code
    /// initialises. `reset_flags` is what RCC_CSR says of the cause.
    ///
    /// # Errors
    ///
    /// As [`Self::boot`]; and [`EmulatorError::LateReset`] later than 4.2 s of virtual time, after which the
    /// tick would stand still.
    pub fn reset(&mut self, reset_flags: u32, limit: Duration) -> Result<BootReport, EmulatorError> {
        let mut client = self.debug()?;
        let reset_at = request_reset(&mut client)
            .and_then(|since_reset_ns| tick_alignment::start_clock(&mut client).map(|()| since_reset_ns))
            .map_err(|source| EmulatorError::Link { source, output: self.process.output() })?
            .and_then(|since_reset_ns| self.reset_at.checked_add(since_reset_ns))
            .filter(|reset_at| *reset_at <= tick_alignment::LATEST_RESET_NS);
        self.reset_at = reset_at.ok_or(EmulatorError::LateReset)?;
        let circumstances = Circumstances {
            cover: ClockCover::with_reset_flags(reset_flags),
            reset_at: self.reset_at,
            held: self.held,
        };
        boot::boot(client, &self.symbols, circumstances, limit).map_err(|failure| match failure {
            BootFailure::Emulator(error) => error,
            BootFailure::Link(source) => EmulatorError::Link { source, output: self.process.output() },
        })
    }

    /// Where the image's stack is. It was painted before the image started.
    pub fn stack(&self) -> StackRegion {
        self.stack
    }

    /// How the start-up went.
    pub fn boot_report(&self) -> BootReport {
        self.report
    }

    /// The emulator's version.
    pub fn version(&self) -> QemuVersion {
        self.version
    }

    /// The emulator's process number.
    pub fn process_id(&self) -> u32 {
        self.process.id()
    }

    /// Checks that the emulator still runs.
    ///
    /// # Errors
    ///
    /// [`EmulatorError::Process`] with what it printed where it has ended.
    pub fn check_running(&mut self) -> Result<(), EmulatorError> {
        match self.process.ended() {
            None => Ok(()),
            Some(status) => Err(EmulatorError::Process {
                what: format!("the emulator ended ({status})"),
                output: self.process.output(),
            }),
        }
    }
}

/// Resets a stopped CPU and returns how long it has run, as [`tick_alignment::since_reset_ns`] knows it.
fn request_reset<S: Read + Write>(client: &mut RspClient<S>) -> Result<Option<u32>, RspError> {
    /// Application interrupt and reset control, its key and "system reset request".
    const AIRCR: u32 = 0xe000_ed0c;
    const SYSTEM_RESET: u32 = 0x05fa_0004;
    const STACK_POINTER: u8 = 13;
    const MARK: u32 = 0x1357_9bd8;
    let since_reset_ns = tick_alignment::since_reset_ns(client)?;
    // The reset comes some time after the request; it is over when it has set the stack pointer anew.
    client.set_register(STACK_POINTER, MARK)?;
    client.write_word(AIRCR, SYSTEM_RESET)?;
    let deadline = Instant::now() + Duration::from_secs(5);
    while client.register(STACK_POINTER)? == MARK {
        if Instant::now() >= deadline {
            return Err(RspError::Timeout { limit: Duration::from_secs(5) });
        }
        std::thread::sleep(Duration::from_millis(1));
    }
    Ok(since_reset_ns)
}

fn connect(gdb: &Path) -> std::io::Result<UnixStream> {
    let stream = UnixStream::connect(gdb)?;
    // Short, so that the protocol's own limits are kept.
    stream.set_read_timeout(Some(Duration::from_millis(100)))?;
    Ok(stream)
}

/// Starts the emulator; `gdb` and `terminal` are to be its debug link and serial port, `output` has what it
/// says.
fn start(
    image: &Path,
    options: &EmulatorOptions,
    [gdb, terminal, output]: [&Path; 3],
    listener: Option<Listener>,
) -> Result<QemuProcess, EmulatorError> {
    let mut arguments = arguments(image, options.shift, gdb, terminal);
    let Some(listener) = listener else {
        return QemuProcess::start(&options.qemu, &arguments, output, None);
    };
    arguments.extend(["-d", "unimp"].map(str::to_owned));
    let failed = |source| EmulatorError::system("listening to the emulator", source);
    let (log, writer) = std::io::pipe().map_err(failed)?;
    let process = QemuProcess::start(&options.qemu, &arguments, output, Some(writer))?;
    let messages = std::fs::OpenOptions::new().append(true).open(output).map_err(failed)?;
    unmodelled::listen(log, messages, listener);
    Ok(process)
}

fn arguments(image: &Path, shift: u8, gdb: &Path, terminal: &Path) -> Vec<String> {
    // QEMU separates suboptions by commas and writes a literal comma twice.
    let quoted = |path: &Path| path.display().to_string().replace(',', ",,");
    [
        "-M".to_owned(),
        "olimex-stm32-h405".to_owned(),
        "-nodefaults".to_owned(),
        "-nographic".to_owned(),
        "-monitor".to_owned(),
        "none".to_owned(),
        "-chardev".to_owned(),
        format!("pty,id=serial,path={}", quoted(terminal)),
        "-serial".to_owned(),
        "chardev:serial".to_owned(),
        "-icount".to_owned(),
        format!("shift={shift},sleep=off"),
        "-S".to_owned(),
        "-gdb".to_owned(),
        format!("unix:{},server=on,wait=off", quoted(gdb)),
        "-kernel".to_owned(),
        image.display().to_string(),
    ]
    .to_vec()
}

/// Tries `open` until it works, the emulator ends or time is up.
fn wait_for<T>(
    process: &mut QemuProcess,
    deadline: Instant,
    what: &str,
    mut open: impl FnMut() -> std::io::Result<T>,
) -> Result<T, EmulatorError> {
    loop {
        let error = match open() {
            Ok(opened) => return Ok(opened),
            Err(error) => error,
        };
        let failure = match process.ended() {
            Some(status) => format!("the emulator ended before it opened {what} ({status})"),
            None if Instant::now() >= deadline => {
                format!("the emulator did not open {what}: {error}")
            }
            None => {
                std::thread::sleep(Duration::from_millis(1));
                continue;
            }
        };
        return Err(EmulatorError::Process { what: failure, output: process.output() });
    }
}
