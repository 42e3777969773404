//! Data types of a device.

use std::io::{Read, Write};

use dimsart_core::{AxisKind, DataTypeDescription, Shape, Vocabulary};
use serde::Serialize;

use super::{ConnectError, Device};

/// Unit and shape of a signal. A port can be bound to signals of the same form.
#[derive(Debug, Clone, Default, PartialEq, Eq, Serialize)]
pub struct SignalForm {
    /// Unit; empty for a pure number, `any` for a port that takes the unit of its signal.
    pub unit: String,
    /// Number of words, such as `3`, or rows and columns of a matrix, such as `6x3`.
    pub shape: String,
}

/// A data type that a signal can have.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct DataTypeReport {
    /// Name, also of the signal.
    pub name: String,
    /// Unit and shape.
    #[serde(flatten)]
    pub form: SignalForm,
}

impl SignalForm {
    pub(super) fn of(data_type: &DataTypeDescription<'_>, axes: &[AxisKind]) -> Self {
        let (unit, dof) = (data_type.unit.for_axes(axes).to_string(), axes.len());
        let shape = match data_type.shape {
            Shape::Scalar => "1".to_owned(),
            Shape::Vector => dof.to_string(),
            Shape::Matrix(rows, columns) => format!("{rows}x{columns}"),
            Shape::Square => format!("{dof}x{dof}"),
        };
        Self { unit, shape }
    }
}

impl<S: Read + Write> Device<S> {
    /// Lists the data types of the device.
    ///
    /// # Errors
    /// [`ConnectError`] when the device does not answer.
    pub fn data_types(&mut self) -> Result<Vec<DataTypeReport>, ConnectError> {
        self.know(|known| {
            let report = |data_type: DataTypeDescription<'_>| DataTypeReport {
                name: data_type.name.to_owned(),
                form: SignalForm::of(&data_type, known.axes()),
            };
            known.type_texts().map(report).collect()
        })
    }
}
