//! Vectors in space.

pub(super) type Vector = [f64; 3];

pub(super) fn dot([x, y, z]: Vector, [other_x, other_y, other_z]: Vector) -> f64 {
    x * other_x + y * other_y + z * other_z
}

pub(super) fn cross([x, y, z]: Vector, [other_x, other_y, other_z]: Vector) -> Vector {
    [y * other_z - z * other_y, z * other_x - x * other_z, x * other_y - y * other_x]
}

pub(super) fn plus([x, y, z]: Vector, [other_x, other_y, other_z]: Vector) -> Vector {
    [x + other_x, y + other_y, z + other_z]
}

pub(super) fn scaled([x, y, z]: Vector, factor: f64) -> Vector {
    [x * factor, y * factor, z * factor]
}

/// Rotates from `x` towards `y` by the angle of this sine and cosine.
pub(super) fn turned(x: Vector, y: Vector, (sin, cos): (f64, f64)) -> (Vector, Vector) {
    (plus(scaled(x, cos), scaled(y, sin)), plus(scaled(x, -sin), scaled(y, cos)))
}
