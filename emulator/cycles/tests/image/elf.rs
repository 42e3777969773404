//! Writer of small ELF files: flash at 0x08000000, initial values of RAM at 0x20000000, and code that is
//! copied to 0x10000000 at startup, followed by variables.

pub(crate) const FUNCTION: u8 = 2;
pub(crate) const OBJECT: u8 = 1;
pub(crate) const GLOBAL: u8 = 0x10;
pub(crate) const TEXT: u16 = 1;
pub(crate) const DATA: u16 = 2;
pub(crate) const STACK_SIZES: u16 = 3;
pub(crate) const CCM: u16 = 7;
pub(crate) const ABSOLUTE: u16 = 0xFFF1;

/// Name, value, size, kind, section.
pub(crate) type Symbol = (&'static str, u32, u32, u8, u16);

pub(crate) struct Elf {
    pub(crate) machine: u16,
    pub(crate) text: Vec<u8>,
    pub(crate) data: Vec<u8>,
    pub(crate) ccm: Vec<u8>,
    pub(crate) stack_sizes: Vec<u8>,
    pub(crate) symbols: Vec<Symbol>,
}

/// Bytes before the first section: the file header and program headers.
const HEADERS: u32 = 52 + 4 * 32;
/// Bytes of variables after the code in the CCM.
const VARIABLES: u32 = 8;

fn words(words: &[u32]) -> Vec<u8> {
    words.iter().flat_map(|word| word.to_le_bytes()).collect()
}

fn halves(halves: &[u16]) -> Vec<u8> {
    halves.iter().flat_map(|half| half.to_le_bytes()).collect()
}

fn length(bytes: &[u8]) -> u32 {
    u32::try_from(bytes.len()).unwrap_or(u32::MAX)
}

impl Elf {
    pub(crate) fn bytes(&self) -> Vec<u8> {
        let mut strings = vec![0];
        let mut symbols = vec![0; 16];
        for &(name, value, size, kind, section) in &self.symbols {
            symbols.extend(words(&[length(&strings), value, size]));
            symbols.extend([kind, 0]);
            symbols.extend(section.to_le_bytes());
            strings.extend(name.bytes().chain([0]));
        }
        let names = b"\0.text\0.data\0.stack_sizes\0.symtab\0.strtab\0.ccm\0".to_vec();

        // Name, type, flags, address, bytes, link, size of an entry.
        let flash = 0x0800_0000;
        let data_at = flash + length(&self.text);
        let ccm = 0x1000_0000;
        let sections = [
            (0, 0, 0, 0, Vec::new(), 0, 0),
            (1, 1, 6, flash, self.text.clone(), 0, 0),
            (7, 1, 3, 0x2000_0000, self.data.clone(), 0, 0),
            (13, 1, 0, 0, self.stack_sizes.clone(), 0, 0),
            (26, 2, 0, 0, symbols, 5, 16),
            (34, 3, 0, 0, strings, 0, 0),
            (0, 3, 0, 0, names, 0, 0),
            (42, 1, 6, ccm, self.ccm.clone(), 0, 0),
        ];
        let mut contents = Vec::new();
        let mut headers = Vec::new();
        let mut ccm_from = 0;
        for (name, kind, flags, address, bytes, link, entry) in sections {
            let offset = HEADERS + length(&contents);
            ccm_from = offset;
            headers.extend(words(&[name, kind, flags, address, offset, length(&bytes), link, 0, 1, entry]));
            contents.extend(bytes);
        }
        let end = HEADERS + length(&contents);
        let (text, data) = (length(&self.text), length(&self.data));

        let mut file = vec![0x7F, b'E', b'L', b'F', 1, 1, 1, 0, 0, 0, 0, 0, 0, 0, 0, 0];
        file.extend(halves(&[2, self.machine]));
        file.extend(words(&[1, flash + 1, 52, end, 0x0500_0400]));
        file.extend(halves(&[52, 32, 4, 40, 8, 6]));
        file.extend(words(&[1, HEADERS, flash, flash, text, text, 5, 4]));
        file.extend(words(&[1, HEADERS + text, 0x2000_0000, data_at, data, data, 6, 4]));
        let copied = length(&self.ccm);
        file.extend(words(&[1, ccm_from, ccm, data_at + data, copied, copied, 5, 4]));
        file.extend(words(&[1, ccm_from + copied, ccm + copied, ccm + copied, 0, VARIABLES, 6, 4]));
        file.extend(contents);
        file.extend(headers);
        file
    }
}
