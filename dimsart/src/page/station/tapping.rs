//! The signals of every tick.

use std::sync::Arc;
use std::thread;
use std::time::Duration;

use super::super::news::Board;
use super::{OpenLine, PAUSE, greet};
use crate::connect::Tap;

/// How often the rows of ticks go out: a screen's picture.
const PICTURE: Duration = Duration::from_millis(20);

/// The thread.
pub(super) fn tap(news: &Board, open: &OpenLine, every_ticks: u32) {
    let mut number = 0;
    loop {
        if let Ok(mut device) = greet(open) {
            let (mut tap, mut told) = (Tap::new(every_ticks), Arc::from([]));
            while let Ok(rows) = device.tap(&mut tap, PICTURE) {
                if *told != *tap.signals() {
                    number += 1;
                    told = tap.signals().into();
                    news.layout(number, every_ticks, &told);
                }
                news.rows(number, &told, rows);
            }
        }
        thread::sleep(PAUSE);
    }
}
