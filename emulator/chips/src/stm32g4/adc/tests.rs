//! ADCs, amplifiers and timer 1, tested by register writes.

use cycles::image::Image;
use cycles::instruction::Width;
use cycles::processor::{AccessPoint, Bus as _};

use crate::stm32g4::VoltageSource;
use crate::{ChipModel, Stm32g4};

const RCC_AHB2ENR: u32 = 0x4002_104C;
const RCC_APB2ENR: u32 = 0x4002_1060;
const GPIOA_MODER: u32 = 0x4800_0000;
const ADC1: u32 = 0x5000_0000;
const ADC2: u32 = 0x5000_0100;
const ISR: u32 = 0x00;
const IER: u32 = 0x04;
const CR: u32 = 0x08;
const CFGR: u32 = 0x0C;
const CFGR2: u32 = 0x10;
const SMPR1: u32 = 0x14;
const SQR1: u32 = 0x30;
const DR: u32 = 0x40;
const JSQR: u32 = 0x4C;
const JDR1: u32 = 0x80;
const CCR: u32 = 0x5000_0308;
const OPAMP1: u32 = 0x4001_0300;
const TIM1: u32 = 0x4001_2C00;

const VREGEN: u32 = 1 << 28;
const ADEN: u32 = 1;
const ADSTART: u32 = 1 << 2;
const JADSTART: u32 = 1 << 3;
const ADCAL: u32 = 1 << 31;
const EOC: u32 = 1 << 2;
const JEOC: u32 = 1 << 5;
const JEOS: u32 = 1 << 6;
/// A quarter of the bus clock.
const BY_FOUR: u32 = 3 << 16;
const BUS_HZ: f64 = 168e6;
const TOP: u32 = 4_200;

struct Lab {
    chip: Stm32g4,
    now: u64,
}

impl Lab {
    /// A chip whose ADCs run at a quarter of the bus clock.
    fn new() -> Self {
        let mut lab = Self { chip: Stm32g4::new(ChipModel::G431cb, &Image::default(), None), now: 1000 };
        lab.write(RCC_AHB2ENR, 0x2003);
        lab.write(RCC_APB2ENR, 0x801);
        lab.chip.clock.change(BUS_HZ, 1000);
        lab.write(CCR, BY_FOUR);
        lab
    }

    /// The same chip, with both ADCs ready.
    fn ready() -> Self {
        let mut lab = Self::new();
        for adc in [ADC1, ADC2] {
            lab.enable(adc);
        }
        lab
    }

    fn enable(&mut self, adc: u32) {
        self.write(adc + CR, VREGEN);
        self.wait(3_360);
        self.write(adc + CR, VREGEN | ADCAL);
        while self.read(adc + CR) & ADCAL != 0 {}
        while self.read(adc + ISR) & 1 == 0 {
            self.write(adc + CR, VREGEN | ADEN);
        }
    }

    fn write(&mut self, address: u32, value: u32) {
        self.now += 1;
        self.chip.store(address, Width::Word, value, AccessPoint { cycle: self.now, code: 0 }).unwrap();
    }

    fn read(&mut self, address: u32) -> u32 {
        self.now += 1;
        self.chip.load(address, Width::Word, AccessPoint { cycle: self.now, code: 0 }).unwrap()
    }

    fn wait(&mut self, cycles: u64) {
        self.now += cycles;
        self.chip.advance(self.now);
    }

    /// Advances from event to event, as a processor does, until the ADC interrupt; returns its cycle.
    fn interrupt(&mut self) -> u64 {
        while self.chip.lines() >> 18 & 1 == 0 {
            self.now = self.chip.next_event();
            self.chip.advance(self.now);
        }
        self.now
    }

    /// A regular conversion of a channel, with the longest sampling time.
    fn convert(&mut self, adc: u32, channel: u32) -> u32 {
        self.write(adc + SMPR1, 0x3FFF_FFFF);
        self.write(adc + SMPR1 + 4, 0x07FF_FFFF);
        self.write(adc + SQR1, channel << 6);
        self.write(adc + CR, VREGEN | ADSTART);
        while self.read(adc + ISR) & EOC == 0 {}
        self.read(adc + DR)
    }

    /// Starts timer 1, counting up and down, with update events at its maximum.
    fn start_timer(&mut self, compares: [u32; 4]) {
        for (offset, value) in [
            (0x00, 0xA0),
            (0x2C, TOP),
            (0x30, 1),
            (0x18, 0x6868),
            (0x1C, 0x6868),
            (0x20, 0x0555),
            (0x34, compares[0]),
            (0x38, compares[1]),
            (0x3C, compares[2]),
            (0x40, compares[3]),
            (0x14, 1),
            (0x44, 0x8C83),
        ] {
            self.write(TIM1 + offset, value);
        }
        // An update at every other reversal from the first one: at the maximum, not at the minimum.
        self.write(TIM1 + 0x30, 0);
        self.write(TIM1 + 0x14, 1);
        self.write(TIM1 + 0x30, 1);
        self.write(TIM1, 0xA1);
    }

    fn violations(&self) -> Vec<&str> {
        self.chip.violations().iter().map(|violation| violation.description.as_str()).collect()
    }

    fn violates(&self, what: &str) {
        assert!(
            self.violations().iter().any(|known| known.contains(what)),
            "{what}: {:?}",
            self.violations()
        );
    }
}

/// A shunt of the board: channel, voltage while the lower switch is closed.
fn shunt(channel: u32, low_v: f64) -> VoltageSource {
    VoltageSource::Shunt { channel, low_v, high_v: 0.5, open_v: 0.25 }
}

#[test]
fn counts_are_proportional_to_voltage_and_saturate_at_the_supply() {
    let mut lab = Lab::ready();
    for (volts, counts) in [(-1.0, 0), (0.0, 0), (0.825, 1024), (1.65, 2048), (3.2995, 4095), (5.0, 4095)] {
        lab.chip.set_voltage('A', 0, volts);
        for adc in [ADC1, ADC2] {
            assert_eq!(lab.convert(adc, 1), counts, "{volts} V");
        }
    }
    assert_eq!(lab.violations(), [] as [&str; 0]);
}

#[test]
fn a_conversion_takes_the_sampling_time_plus_12_and_a_half_ticks() {
    let mut lab = Lab::ready();
    lab.chip.set_voltage('A', 0, 1.0);
    lab.write(ADC1 + JSQR, 1 << 9);
    for (code, halves) in (0..).zip([5, 13, 25, 49, 95, 185, 495, 1281]) {
        lab.write(ADC1 + SMPR1, code << 3);
        lab.write(ADC1 + ISR, JEOC | JEOS);
        lab.write(ADC1 + IER, JEOS);
        lab.write(ADC1 + CR, VREGEN | JADSTART);
        let started = lab.now;
        // Sampling starts after 2.125 ticks.
        assert_eq!(lab.interrupt() - started, 9 + 2 * (halves + 25), "{halves} half ticks");
        assert_eq!(lab.read(ADC1 + CR) & JADSTART, 0);
    }
    assert_eq!(lab.violations(), [] as [&str; 0]);
}

#[test]
fn the_result_is_the_voltage_at_the_end_of_sampling() {
    let mut lab = Lab::ready();
    lab.write(ADC1 + JSQR, 1 << 9);
    lab.write(ADC1 + SMPR1, 4 << 3);
    for (waits, counts) in [(198, 2048), (199, 1024)] {
        lab.chip.set_voltage('A', 0, 0.825);
        lab.write(ADC1 + CR, VREGEN | JADSTART);
        lab.wait(waits);
        lab.chip.set_voltage('A', 0, 1.65);
        lab.wait(1000);
        assert_eq!(lab.read(ADC1 + JDR1), counts, "sampling ends after 9 plus 47.5 times 4 cycles");
    }
}

#[test]
fn timer_1_triggers_both_adcs_while_the_lower_switches_are_closed() {
    let mut lab = Lab::ready();
    // U, W, temperature; V, supply. Triggered by TRGO2.
    for (adc, jsqr) in [
        (ADC1, 5 << 21 | 12 << 15 | 3 << 9 | 1 << 7 | 8 << 2 | 2),
        (ADC2, 1 << 15 | 3 << 9 | 1 << 7 | 8 << 2 | 1),
    ] {
        lab.write(adc + JSQR, jsqr);
        lab.write(adc + SMPR1, 1 << 9 | 4 << 3 | 4 << 15);
        lab.write(adc + SMPR1 + 4, 1 << 6);
    }
    lab.chip.connect_voltage_source('A', 2, shunt(0, 1.1));
    lab.chip.connect_voltage_source('A', 6, shunt(1, 1.2));
    lab.chip.connect_voltage_source('B', 1, shunt(2, 1.3));
    lab.chip.set_voltage('B', 14, 1.4);
    lab.chip.set_voltage('A', 0, 1.5);
    lab.write(ADC1 + IER, JEOS);
    lab.start_timer([1000, 2000, 3780, 0]);
    let started = lab.now;
    lab.write(TIM1 + 0x04, 2 << 20);
    lab.write(ADC2 + CR, VREGEN | JADSTART);
    lab.write(ADC1 + CR, VREGEN | JADSTART);
    for period in 0..3 {
        let end = lab.interrupt();
        // 2.125 ticks; two conversions of 6.5 and 12.5 ticks; one of 47.5 and 12.5 ticks.
        assert_eq!(end, started + u64::from(TOP + 2 * TOP * period) + 9 + 2 * 76 + 240, "{period}");
        let volts = |counts: u32| f64::from(counts) * 3.3 / 4096.0;
        let read: Vec<f64> = [JDR1, JDR1 + 4, JDR1 + 8].map(|place| volts(lab.read(ADC1 + place))).into();
        let other: Vec<f64> = [JDR1, JDR1 + 4].map(|place| volts(lab.read(ADC2 + place))).into();
        for (read, wired) in read.iter().chain(&other).zip([1.1, 1.3, 1.4, 1.2, 1.5]) {
            assert!((read - wired).abs() < 0.001, "{read} V");
        }
        lab.write(ADC1 + ISR, JEOC | JEOS);
    }
    assert_eq!(lab.violations(), [] as [&str; 0]);
}

#[test]
fn a_shunt_measures_current_only_while_its_lower_switch_is_closed() {
    // Sampled 9 + 26 cycles after the maximum. At 4190, that is within the dead time of 134 cycles.
    for (compare, volts) in [(0, 1.0), (3780, 1.0), (4190, 0.25), (4200, 0.5)] {
        let mut lab = Lab::ready();
        lab.write(ADC1 + JSQR, 3 << 9 | 1 << 7 | 8 << 2);
        lab.write(ADC1 + SMPR1, 1 << 9);
        lab.chip.connect_voltage_source('A', 2, shunt(0, 1.0));
        lab.write(ADC1 + IER, JEOS);
        lab.start_timer([compare, 0, 0, 0]);
        lab.write(TIM1 + 0x04, 2 << 20);
        lab.write(ADC1 + CR, VREGEN | JADSTART);
        lab.interrupt();
        let read = f64::from(lab.read(ADC1 + JDR1)) * 3.3 / 4096.0;
        assert!((read - volts).abs() < 0.001, "{compare}: {read} V");
        // With the bridge off, both switches open at once.
        lab.write(TIM1 + 0x44, 0x0C83);
        lab.write(ADC1 + ISR, JEOC | JEOS);
        lab.interrupt();
        assert!((f64::from(lab.read(ADC1 + JDR1)) * 3.3 / 4096.0 - 0.25).abs() < 0.001);
    }
}

#[test]
fn a_channel_s_reference_triggers_at_its_edges() {
    // Active below the compare value when counting up, from the compare value when counting down: its edges
    // are at 4000 and 2 * 4200 - 4000.
    for (edges, expected) in [(1, [4400, 12_800]), (2, [4000, 12_400]), (3, [4000, 4400])] {
        for (select, trigger) in [(7 << 20, 8), (7 << 4, 0)] {
            let mut lab = Lab::ready();
            lab.chip.set_voltage('A', 0, 1.0);
            lab.write(ADC1 + JSQR, 1 << 9 | edges << 7 | trigger << 2);
            lab.write(ADC1 + IER, JEOS);
            lab.start_timer([0, 0, 0, 4000]);
            let started = lab.now;
            lab.write(TIM1 + 0x04, select);
            lab.write(ADC1 + CR, VREGEN | JADSTART);
            for at in expected {
                assert_eq!(lab.interrupt(), started + at + 9 + 60, "{edges} {trigger}");
                lab.write(ADC1 + ISR, JEOC | JEOS);
            }
            assert_eq!(lab.violations(), [] as [&str; 0]);
        }
    }
}

#[test]
fn an_injected_sequence_interrupts_a_regular_conversion() {
    let mut lab = Lab::ready();
    lab.chip.set_voltage('A', 0, 1.65);
    lab.chip.set_voltage('A', 1, 0.825);
    lab.write(ADC1 + SMPR1, 4 << 3);
    lab.write(ADC1 + SQR1, 1 << 6);
    lab.write(ADC1 + JSQR, 2 << 9);
    lab.write(ADC1 + CR, VREGEN | ADSTART);
    lab.wait(100);
    lab.write(ADC1 + CR, VREGEN | JADSTART);
    lab.wait(9 + 60);
    assert_eq!(lab.read(ADC1 + ISR) & (JEOS | EOC), JEOS);
    assert_eq!(lab.read(ADC1 + JDR1), 1024);
    lab.wait(240);
    assert_eq!(lab.read(ADC1 + ISR) & EOC, EOC);
    assert_eq!(lab.read(ADC1 + DR), 2048);
    assert_eq!(lab.read(ADC1 + ISR) & EOC, 0);
}

#[test]
fn amplifiers_apply_their_gains() {
    for (code, gain) in (0..).zip([2.0, 4.0, 8.0, 16.0, 32.0, 64.0]) {
        let mut lab = Lab::ready();
        lab.chip.set_voltage('A', 1, 0.03);
        lab.chip.set_voltage('A', 3, 0.01);
        let control = code << 14 | 2 << 5 | 1;
        // Gain resistors at ground and at VINM0, output at the pin; then internal output.
        for (bits, channel, expected) in
            [(0, 3, 0.03 * gain), (1 << 17, 3, 0.03 * gain - 0.01 * (gain - 1.0)), (1 << 8, 13, 0.03 * gain)]
        {
            lab.write(OPAMP1, control | bits);
            lab.wait(5040);
            let read = f64::from(lab.convert(ADC1, channel)) * 3.3 / 4096.0;
            assert!((read - expected).abs() < 0.001, "{gain}: {read} V, not {expected}");
        }
        lab.chip.set_voltage('A', 1, 2.0);
        assert_eq!(lab.convert(ADC1, 13), 4095, "at most the supply");
        lab.write(OPAMP1, 3 << 5 | 1);
        assert!(lab.convert(ADC1, 3).abs_diff(2482) <= 1, "a follower");
        assert_eq!(lab.violations(), [] as [&str; 0]);
    }
}

#[test]
fn use_of_an_adc_that_is_not_ready_is_a_violation() {
    let mut lab = Lab::new();
    lab.write(ADC1 + CR, 1 << 29 | VREGEN);
    lab.violates("deep power-down");
    lab.write(ADC1 + CR, VREGEN);
    lab.wait(3_000);
    lab.write(ADC1 + CR, VREGEN | ADCAL);
    lab.violates("calibrated less than 20 us");
    lab.write(ADC1 + CR, VREGEN | ADEN);
    lab.violates("switched on during its calibration");

    let mut lab = Lab::new();
    lab.write(ADC1 + CR, VREGEN);
    lab.write(ADC1 + CR, VREGEN | ADEN);
    lab.violates("switched on less than 20 us");
    lab.write(ADC1 + CR, VREGEN | ADSTART);
    lab.violates("started before it is ready");
    lab.write(CCR, BY_FOUR);
    lab.violates("ADC12_CCR is written while an ADC is on");
}

#[test]
fn enable_is_ignored_for_four_ticks_after_calibration() {
    let mut lab = Lab::new();
    lab.write(ADC1 + CR, VREGEN);
    lab.wait(3_360);
    lab.write(ADC1 + CR, VREGEN | ADCAL);
    lab.wait(4 * 116 + 5);
    lab.write(ADC1 + CR, VREGEN | ADEN);
    assert_eq!(lab.read(ADC1 + CR) & (ADEN | ADCAL), 0);
    lab.wait(10);
    lab.write(ADC1 + CR, VREGEN | ADEN);
    assert_eq!(lab.read(ADC1 + CR) & ADEN, ADEN);
    assert_eq!(lab.violations(), [] as [&str; 0]);
}

#[test]
fn the_maximum_clock_is_lower_with_both_adcs_on() {
    for (bus_hz, are_both_on, is_allowed) in
        [(103e6, true, true), (105e6, true, false), (119e6, false, true), (121e6, false, false)]
    {
        let mut lab = Lab::new();
        lab.write(CCR, 2 << 16);
        lab.chip.clock.change(bus_hz, lab.now);
        lab.enable(ADC1);
        if are_both_on {
            lab.enable(ADC2);
        }
        lab.chip.set_voltage('A', 0, 1.0);
        lab.convert(ADC1, 1);
        assert_eq!(lab.violations().is_empty(), is_allowed, "{:?}", lab.violations());
    }
}

#[test]
fn unmodelled_settings_and_missing_connections_are_violations() {
    for (offset, value, what) in [
        (CFGR, 1 << 31 | 1 << 13, "CFGR"),
        (CFGR, 0, "CFGR"),
        (CFGR2, 1, "CFGR2"),
        (0x60, 1 << 31, "OFR1"),
        (0xB0, 2, "DIFSEL"),
        (0x58, 1, "no such register"),
    ] {
        let mut lab = Lab::ready();
        lab.write(ADC1 + offset, value);
        lab.violates(what);
    }
    let mut lab = Lab::ready();
    lab.convert(ADC1, 1);
    lab.violates("PA0 is sampled, but no voltage source is connected to it");
    lab.convert(ADC1, 18);
    lab.violates("ADC1 samples channel 18: not modelled");
    lab.convert(ADC1, 13);
    lab.violates("OPAMP1, whose output is not connected to the ADC");
    lab.write(GPIOA_MODER, 0xABFF_FFFC);
    lab.convert(ADC1, 1);
    lab.violates("PA0 is used as an analog pin, but is not in analog mode");
    lab.chip.set_voltage('A', 1, 0.1);
    lab.write(OPAMP1, 3 << 5 | 1);
    lab.convert(ADC1, 3);
    lab.violates("less than 30 us after its start");
    lab.write(OPAMP1, 1 << 11 | 1);
    lab.violates("OPAMP_CSR1 is set to 0x00000801: not modelled");
    lab.write(CCR, BY_FOUR | 6);
    lab.violates("ADC12_CCR selects dual mode or DMA");
}

#[test]
fn early_and_unknown_triggers_are_violations() {
    let mut lab = Lab::ready();
    lab.chip.set_voltage('A', 0, 1.0);
    lab.write(ADC1 + JSQR, 1 << 9 | 3 << 7 | 8 << 2);
    lab.write(ADC1 + SMPR1, 7 << 3);
    lab.start_timer([0, 0, 0, 4000]);
    lab.write(TIM1 + 0x04, 7 << 20);
    lab.write(ADC1 + CR, VREGEN | JADSTART);
    lab.wait(8_400);
    lab.violates("triggered while its injected sequence still runs");
    lab.write(ADC1 + JSQR, 1 << 9);
    lab.violates("ADC1_JSQR is written while conversions are started");

    let mut lab = Lab::ready();
    lab.write(ADC1 + JSQR, 1 << 7 | 1 << 2);
    lab.write(ADC1 + CR, VREGEN | JADSTART);
    lab.violates("JEXTSEL is 1: not modelled");
    lab.write(ADC2 + JSQR, 1 << 7 | 8 << 2);
    lab.write(TIM1 + 0x04, 10 << 20);
    lab.write(ADC2 + CR, VREGEN | JADSTART);
    lab.violates("TIM1_CR2.MMS2 is 10: trigger source not modelled");
}
