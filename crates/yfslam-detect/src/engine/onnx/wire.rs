//! The protobuf wire format: converts bytes to (field number, value) pairs.
//!
//! Source: <https://protobuf.dev/programming-guides/encoding/>. Reading only, borrowed, without a schema.

/// What is wrong with the bytes.
#[derive(Debug)]
pub(crate) struct WireError(pub(crate) String);

/// A field's value, by wire type.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Value<'a> {
    /// Integers, enumerations, booleans.
    Varint(u64),
    /// `double` and `fixed64`; no field that is read has this type.
    Fixed64,
    /// Strings, bytes, messages, packed lists.
    Bytes(&'a [u8]),
    /// `float` and `fixed32`, little endian.
    Fixed32(u32),
}

impl<'a> Value<'a> {
    pub(crate) fn bytes(self) -> Result<&'a [u8], WireError> {
        match self {
            Value::Bytes(bytes) => Ok(bytes),
            other => Err(WireError(format!("expected text or a message, found {other:?}"))),
        }
    }

    pub(crate) fn text(self) -> Result<&'a str, WireError> {
        std::str::from_utf8(self.bytes()?).map_err(|error| WireError(format!("a name is not UTF-8 text ({error})")))
    }

    pub(crate) fn int(self) -> Result<i64, WireError> {
        match self {
            Value::Varint(value) => Ok(value as i64),
            other => Err(WireError(format!("expected an integer, found {other:?}"))),
        }
    }

    /// Appends one integer or a packed list of them.
    pub(crate) fn ints(self, out: &mut Vec<i64>) -> Result<(), WireError> {
        if let Value::Bytes(bytes) = self {
            let mut reader = Fields::new(bytes);
            while !reader.rest.is_empty() {
                out.push(reader.varint()? as i64);
            }
        } else {
            out.push(self.int()?);
        }
        Ok(())
    }

    /// Appends one float or a packed list of them.
    pub(crate) fn floats(self, out: &mut Vec<f32>) -> Result<(), WireError> {
        match self {
            Value::Fixed32(bits) => out.push(f32::from_bits(bits)),
            Value::Bytes(bytes) => out.extend(bytes.as_chunks::<4>().0.iter().map(|b| f32::from_le_bytes(*b))),
            other => return Err(WireError(format!("expected a float, found {other:?}"))),
        }
        Ok(())
    }
}

/// Iterates over the fields of one message.
pub(crate) struct Fields<'a> {
    rest: &'a [u8],
}

impl<'a> Fields<'a> {
    pub(crate) fn new(message: &'a [u8]) -> Self {
        Self { rest: message }
    }

    fn take(&mut self, count: u64) -> Result<&'a [u8], WireError> {
        let split = usize::try_from(count).ok().and_then(|count| self.rest.split_at_checked(count));
        let (taken, rest) = split.ok_or_else(|| {
            WireError(format!("the data ends early: {count} bytes announced, {} left", self.rest.len()))
        })?;
        self.rest = rest;
        Ok(taken)
    }

    fn varint(&mut self) -> Result<u64, WireError> {
        let mut value = 0;
        for shift in (0..64).step_by(7) {
            let byte = self.take(1)?[0];
            value |= u64::from(byte & 0x7f) << shift;
            if byte & 0x80 == 0 {
                return Ok(value);
            }
        }
        Err(WireError("an integer is longer than 64 bits".into()))
    }

    fn field(&mut self) -> Result<(u64, Value<'a>), WireError> {
        let key = self.varint()?;
        let value = match key & 7 {
            0 => Value::Varint(self.varint()?),
            1 => self.take(8).map(|_| Value::Fixed64)?,
            2 => {
                let length = self.varint()?;
                Value::Bytes(self.take(length)?)
            }
            5 => Value::Fixed32(self.take(4)?.iter().rev().fold(0, |value, byte| value << 8 | u32::from(*byte))),
            other => return Err(WireError(format!("wire type {other} does not exist"))),
        };
        Ok((key >> 3, value))
    }
}

impl<'a> Iterator for Fields<'a> {
    type Item = Result<(u64, Value<'a>), WireError>;

    fn next(&mut self) -> Option<Self::Item> {
        if self.rest.is_empty() {
            return None;
        }
        let field = self.field();
        if field.is_err() {
            self.rest = &[];
        }
        Some(field)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn reads_every_wire_type() {
        // field 1 varint 300; field 2 bytes "hi"; field 3 float 1.0; field 4 fixed64 1
        let bytes = [8, 0xac, 2, 18, 2, b'h', b'i', 29, 0, 0, 0x80, 0x3f, 33, 1, 0, 0, 0, 0, 0, 0, 0];
        let fields: Vec<_> = Fields::new(&bytes).map(Result::unwrap).collect();
        assert_eq!(fields.iter().map(|(number, _)| *number).collect::<Vec<_>>(), [1, 2, 3, 4]);
        assert_eq!(fields[0].1.int().unwrap(), 300);
        assert_eq!(fields[1].1.text().unwrap(), "hi");
        let mut floats = Vec::new();
        fields[2].1.floats(&mut floats).unwrap();
        assert_eq!(floats, [1.0]);
        assert!(matches!(fields[3].1, Value::Fixed64));
    }

    #[test]
    fn a_length_beyond_the_end_is_an_error_not_a_panic() {
        for bytes in
            [&[18, 200][..], &[18, 0xff, 0xff, 0xff, 0xff, 0xff, 0xff, 0xff, 0xff, 1], &[8], &[8, 0xff, 0xff], &[7]]
        {
            assert!(Fields::new(bytes).any(|field| field.is_err()), "{bytes:?}");
        }
    }
}
