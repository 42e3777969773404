//! Boots an image.
use chips::{Part, Stm32g4};
use cycles::processor::Processor;
use cycles::timing::{Column, Flash, Profile, Timing};
use std::sync::Arc;
fn main() {
    let a: Vec<String> = std::env::args().collect();
    let bytes = std::fs::read(&a[1]).unwrap();
    let image = Arc::new(cycles::image::Image::read(&bytes).unwrap());
    let (part, hz) = if a[1].contains("nucleo") { (Part::G474re, 24e6) } else { (Part::G431cb, 8e6) };
    let chip = Stm32g4::new(part, &image, Some(hz));
    let mut p =
        Processor::new(image.clone(), chip, Timing::new(Profile::Flash(Flash::STM32G4), Column::Likely))
            .unwrap();
    let t = std::time::Instant::now();
    let end: f64 = a[2].parse().unwrap();
    let mut now = 0.0;
    while now < end {
        now += 0.01;
        let to = p.bus.clock().cycle_at(now);
        if let Err(e) = p.run_until(to) {
            println!("{e}");
            break;
        }
    }
    println!(
        "{:?} host; {} cycles {} instr {} s, state {:?} at {}",
        t.elapsed(),
        p.cycles(),
        p.instructions(),
        p.bus.clock().seconds_at(p.cycles()),
        p.state(),
        p.place()
    );
    println!("{:?} connected {:?}", p.bus.clock(), p.bus.connected());
    for f in p.faults().iter().take(5) {
        println!("fault {f:?}");
    }
    let m = p.take_longest_masked();
    println!(
        "resets {} masked {:?} wd {}",
        format!("{:?}", p.bus.resets()),
        m,
        p.bus.least_watchdog_left_s()
    );
    for v in p.bus.violations().iter().take(8) {
        println!("{} {}: {}", v.at.cycle, image.place(v.at.code), v.what);
    }
    for u in ["LPUART1", "USART2"] {
        println!("{u} sent {} baud {:?}", p.bus.take_sent(u).len(), p.bus.baud(u));
    }
    if let Some(base) = a.get(4) { let base = u32::from_str_radix(base, 16).unwrap(); for o in (0..0x50).step_by(4) { print!("{o:#x}={:#x} ", p.read_word(base + o).unwrap()); } println!(); }
    println!("journal {}", p.bus.journal.lines().len());
    for l in p.bus.journal.lines().iter().take(a.get(3).map_or(0, |n| n.parse().unwrap())) {
        println!("{l}");
    }
}
