//! `table`: a shaper that was designed elsewhere.

use core::fmt::Write;

use super::say;
use super::upload::finish_upload;
use super::words::on_off;
use crate::console::Console;
use crate::console::error::CommandError;
use crate::console::upload::{UploadError, UploadKind};
use crate::decimal::Decimal;
use crate::shaper::UploadedTable;

impl Console<'_> {
    /// Uses the table as `apply` would use one of the settings. A refusal leaves what runs and what was
    /// uploaded before as they were.
    pub(super) fn commit_table(&mut self, out: &mut dyn Write) -> Result<(), CommandError<'static>> {
        let table = finish_upload(&mut self.upload, UploadKind::Table, self.arriving, |tick_rate, bytes| {
            UploadedTable::new(tick_rate, bytes).map_err(UploadError::Taps)
        })?;
        let crc32 = table.crc32();
        let mut settings = self.live.clone();
        settings.use_uploaded_table();
        let before = self.uploaded.replace(table);
        if let Err(refusal) = self.run(&settings, self.shaper_on, "table") {
            self.uploaded = before;
            return Err(refusal);
        }
        self.upload = None;
        self.live = settings;
        self.staged.use_uploaded_table();
        let shown = self.uploaded.as_ref().map(|table| table.table());
        let (stages, taps) = shown.map_or((0, 0), |table| {
            (table.stages().len(), table.stages().map(|stage| stage.taps().len()).sum::<usize>())
        });
        say(
            out,
            format_args!(
                "ok table committed crc32=0x{crc32:08x} stages={stages} taps={taps} shaper={}",
                on_off(self.shaper_on)
            ),
        );
        Ok(())
    }

    pub(super) fn show_table(&self, out: &mut dyn Write) {
        self.show_upload(UploadKind::Table, out);
        match &self.uploaded {
            None => say(out, format_args!("table none")),
            Some(uploaded) => {
                let table = uploaded.table();
                say(out, format_args!("table 0x{:08x}", uploaded.crc32()));
                say(out, format_args!("table_rate_hz {}", Decimal(uploaded.tick_rate().hz())));
                say(out, format_args!("table_duration_ms {:.3}", Decimal(table.duration_s() * 1e3)));
                say(out, format_args!("table_delay_ms {:.3}", Decimal(table.delay_s() * 1e3)));
                for (stage, number) in table.stages().zip(1..) {
                    say(out, format_args!("stage {number}"));
                    for tap in stage.taps() {
                        say(out, format_args!("tap {} {}", tap.delay_ticks, tap.weight));
                    }
                }
            }
        }
        say(out, format_args!("ok table show"));
    }
}
