//! Scratch
use dimsart_core::*;
fn main() {
    let arguments: Vec<String> = std::env::args().collect();
    let what = arguments[1].as_str();
    let ticks: u32 = arguments[2].parse().unwrap();
    let axes = [AxisKind::Linear; 3];
    let device = DeviceDescriptor::new("arm", &axes, 1e-3, &[types::POSITION], &[types::DES_FORCE]).unwrap();
    let mut d: Dimsart = Dimsart::new(device).unwrap();
    let text = match what {
        "table1" => include_str!("../../schemes/bilateral.scheme").to_string(),
        "table1-norx" => include_str!("../../schemes/bilateral.scheme").to_string(),
        _ => panic!(),
    };
    let n = scheme::load(&text, "master", &["master", "slave"], &mut d, |e| println!("{e:?}"));
    assert_eq!(n, 0);
    let mut out = [Word(0); 3];
    let m: [Word; 3] = [0.01f32.into(), 0.02f32.into(), 0.03f32.into()];
    let mut acc = 0u32;
    for _ in 0..ticks {
        std::hint::black_box(d.engine_mut().step());
    }
    acc ^= out[0].0;
    println!("{acc}");
    let _ = (m, &mut out);
}
