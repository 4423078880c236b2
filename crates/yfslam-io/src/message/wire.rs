//! Reads and writes the two forms in which ROS stores a message: that of ROS 1, and CDR of ROS 2 (OMG, "DDS Interoperability Wire
//! Protocol", section 10: plain CDR in both byte orders, and XCDR2 without headers of types).
//!
//! In: the bytes of a message. Out: its fields in order. Nothing is allocated; a length that exceeds the message is an error.

/// How a message is serialised.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Wire {
    /// ROS 1: little endian, without padding; a header has a sequence number.
    Ros1,
    /// ROS 2: CDR with its four bytes of encapsulation, which name the byte order; values are aligned.
    Cdr,
}

/// Bytes that are not the message that was expected.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[error("field '{field}' at byte {at} {problem}")]
pub struct WireError {
    /// The field.
    pub field: &'static str,
    /// Where it begins, bytes from the start of the message.
    pub at: usize,
    /// What is wrong.
    pub problem: &'static str,
}

const TOO_SHORT: &str = "exceeds the message";

/// Reads the fields of a message one after the other.
#[derive(Clone, Debug)]
pub struct Reader<'a> {
    bytes: &'a [u8],
    at: usize,
    wire: Wire,
    big_endian: bool,
    /// Values are aligned to their size, but not further than this, bytes.
    max_alignment: usize,
}

impl<'a> Reader<'a> {
    /// Begins to read a message.
    ///
    /// # Errors
    /// The message is CDR in an encapsulation other than plain CDR or XCDR2.
    pub fn new(wire: Wire, bytes: &'a [u8]) -> Result<Self, WireError> {
        if wire == Wire::Ros1 {
            return Ok(Self { bytes, at: 0, wire, big_endian: false, max_alignment: 1 });
        }
        let error = |problem| WireError { field: "encapsulation", at: 0, problem };
        let (head, _) = bytes.split_first_chunk::<4>().ok_or(error(TOO_SHORT))?;
        let (big_endian, max_alignment) = match head {
            [0, 0, ..] => (true, 8),
            [0, 1, ..] => (false, 8),
            [0, 6, ..] => (true, 4),
            [0, 7, ..] => (false, 4),
            _ => return Err(error("is not plain CDR")),
        };
        Ok(Self { bytes, at: 4, wire, big_endian, max_alignment })
    }

    /// Returns the form of the message.
    pub fn wire(&self) -> Wire {
        self.wire
    }

    /// Takes `length` bytes as they are.
    fn take(&mut self, field: &'static str, length: usize) -> Result<&'a [u8], WireError> {
        let error = WireError { field, at: self.at, problem: TOO_SHORT };
        let end = self.at.checked_add(length).ok_or(error)?;
        let taken = self.bytes.get(self.at..end).ok_or(error)?;
        self.at = end;
        Ok(taken)
    }

    /// Takes a number after its padding, in little endian.
    fn number<const N: usize>(&mut self, field: &'static str) -> Result<[u8; N], WireError> {
        self.align(N);
        let taken = self.take(field, N)?;
        let mut bytes = [0; N];
        bytes.copy_from_slice(taken);
        if self.big_endian {
            bytes.reverse();
        }
        Ok(bytes)
    }

    fn align(&mut self, size: usize) {
        let alignment = size.min(self.max_alignment);
        // CDR counts from the end of its encapsulation, which has four bytes.
        let from = if self.wire == Wire::Cdr { 4 } else { 0 };
        self.at = from + (self.at - from).next_multiple_of(alignment);
    }

    /// Reads a byte.
    ///
    /// # Errors
    /// The message has ended; this holds for all functions that follow.
    pub fn u8(&mut self, field: &'static str) -> Result<u8, WireError> {
        self.number(field).map(|[byte]| byte)
    }

    /// Reads an unsigned number of 32 bits.
    pub fn u32(&mut self, field: &'static str) -> Result<u32, WireError> {
        self.number(field).map(u32::from_le_bytes)
    }

    /// Reads a number of 64 bits in floating point.
    pub fn f64(&mut self, field: &'static str) -> Result<f64, WireError> {
        self.number(field).map(f64::from_le_bytes)
    }

    /// Reads an array of a fixed length.
    pub fn f64s<const N: usize>(&mut self, field: &'static str) -> Result<[f64; N], WireError> {
        let mut values = [0.0; N];
        for value in &mut values {
            *value = self.f64(field)?;
        }
        Ok(values)
    }

    /// Reads the length of a sequence whose items have at least `item_bytes` each, and checks that they can exist.
    pub fn length(&mut self, field: &'static str, item_bytes: usize) -> Result<usize, WireError> {
        let at = self.at;
        let length = self.u32(field)? as usize;
        let needed = length.checked_mul(item_bytes);
        match needed.is_some_and(|needed| needed <= self.bytes.len() - self.at) {
            true => Ok(length),
            false => Err(WireError { field, at, problem: TOO_SHORT }),
        }
    }

    /// Reads a sequence of bytes.
    pub fn bytes(&mut self, field: &'static str) -> Result<&'a [u8], WireError> {
        let length = self.length(field, 1)?;
        self.take(field, length)
    }

    /// Reads a text; CDR ends it with a zero, which is left out.
    pub fn string(&mut self, field: &'static str) -> Result<&'a str, WireError> {
        let at = self.at;
        let bytes = self.bytes(field)?;
        let bytes = if self.wire == Wire::Cdr { bytes.strip_suffix(&[0]).unwrap_or(bytes) } else { bytes };
        std::str::from_utf8(bytes).map_err(|_| WireError { field, at, problem: "is not UTF-8" })
    }

    /// Reads a time, ns.
    pub fn time_ns(&mut self, field: &'static str) -> Result<i64, WireError> {
        let (seconds, nanoseconds) = (self.u32(field)?, self.u32(field)?);
        // ROS 2 has a sign, ROS 1 has none.
        let seconds = if self.wire == Wire::Cdr { i64::from(seconds.cast_signed()) } else { i64::from(seconds) };
        Ok(seconds * 1_000_000_000 + i64::from(nanoseconds))
    }
}

/// Writes the fields of a message one after the other.
#[derive(Clone, Debug)]
pub struct Writer {
    bytes: Vec<u8>,
    wire: Wire,
    big_endian: bool,
}

impl Writer {
    /// Begins a message; `big_endian` is for CDR only.
    pub fn new(wire: Wire, big_endian: bool) -> Self {
        let big_endian = big_endian && wire == Wire::Cdr;
        let bytes = if wire == Wire::Cdr { vec![0, u8::from(!big_endian), 0, 0] } else { Vec::new() };
        Self { bytes, wire, big_endian }
    }

    /// Returns the form of the message.
    pub fn wire(&self) -> Wire {
        self.wire
    }

    /// Returns the message.
    pub fn finish(self) -> Vec<u8> {
        self.bytes
    }

    fn number<const N: usize>(&mut self, mut value: [u8; N]) {
        if self.wire == Wire::Cdr {
            self.bytes.resize(4 + (self.bytes.len() - 4).next_multiple_of(N), 0);
        }
        if self.big_endian {
            value.reverse();
        }
        self.bytes.extend(value);
    }

    /// Writes a byte.
    pub fn u8(&mut self, value: u8) {
        self.number([value]);
    }

    /// Writes an unsigned number of 32 bits.
    pub fn u32(&mut self, value: u32) {
        self.number(value.to_le_bytes());
    }

    /// Writes a number of 64 bits in floating point.
    pub fn f64(&mut self, value: f64) {
        self.number(value.to_le_bytes());
    }

    /// Writes numbers without their count.
    pub fn f64s(&mut self, values: &[f64]) {
        values.iter().for_each(|&value| self.f64(value));
    }

    /// Writes a sequence of bytes; one of more than 4 GiB is cut.
    pub fn bytes(&mut self, bytes: &[u8]) {
        let length = u32::try_from(bytes.len()).unwrap_or(u32::MAX);
        self.u32(length);
        self.bytes.extend(bytes.iter().take(length as usize));
    }

    /// Writes a text.
    pub fn string(&mut self, text: &str) {
        match self.wire {
            Wire::Ros1 => self.bytes(text.as_bytes()),
            Wire::Cdr => self.bytes(&[text.as_bytes(), &[0]].concat()),
        }
    }

    /// Writes a time.
    pub fn time_ns(&mut self, time_ns: i64) {
        self.u32(time_ns.div_euclid(1_000_000_000) as u32);
        self.u32(time_ns.rem_euclid(1_000_000_000) as u32);
    }
}
