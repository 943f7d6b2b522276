//! XML as a tree, read and written. The only file of the tools that knows quick-xml.

use anyhow::{Context, Result, anyhow, bail};
use quick_xml::events::{BytesDecl, BytesStart, BytesText, Event};
use quick_xml::{Reader, Writer, XmlVersion};

/// An element with its attributes and children; character data is kept where no child stands beside it.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Element {
    /// Name with its prefix, as written.
    pub name: String,
    /// Attributes in their order.
    pub attributes: Vec<(String, String)>,
    /// Child elements in their order.
    pub children: Vec<Element>,
    /// Character data.
    pub text: String,
}

impl Element {
    /// An empty element.
    pub fn new(name: &str) -> Self {
        Self { name: name.to_owned(), ..Self::default() }
    }

    /// The element with one more attribute.
    #[must_use]
    pub fn with<V: ToString + ?Sized>(mut self, name: &str, value: &V) -> Self {
        self.attributes.push((name.to_owned(), value.to_string()));
        self
    }

    /// The element with one more attribute if there is a value.
    #[must_use]
    pub fn with_some<V: ToString + ?Sized>(self, name: &str, value: Option<&V>) -> Self {
        match value {
            Some(value) => self.with(name, value),
            None => self,
        }
    }

    /// The element with one more child.
    #[must_use]
    pub fn child(mut self, child: Self) -> Self {
        self.children.push(child);
        self
    }

    /// The element with more children.
    #[must_use]
    pub fn extend(mut self, children: impl IntoIterator<Item = Self>) -> Self {
        self.children.extend(children);
        self
    }

    /// Value of an attribute.
    pub fn get(&self, name: &str) -> Option<&str> {
        self.attributes.iter().find(|(key, _)| key == name).map(|(_, value)| value.as_str())
    }

    /// Value of an attribute that the schema demands.
    pub fn require(&self, name: &str) -> Result<&str> {
        self.get(name).with_context(|| format!("element {} has no attribute {name}", self.name))
    }

    /// First child of that name.
    pub fn find(&self, name: &str) -> Option<&Self> {
        self.children.iter().find(|child| child.name == name)
    }

    /// All children of the child of that name: the entries of a list.
    pub fn list(&self, name: &str) -> &[Self] {
        self.find(name).map_or(&[], |list| &list.children)
    }

    /// Reads a document.
    pub fn parse(document: &str) -> Result<Self> {
        let mut reader = Reader::from_str(document);
        reader.config_mut().trim_text(true);
        let mut open: Vec<Self> = Vec::new();
        loop {
            // The reader's errors repeat their source in what they say.
            let closed = match reader.read_event().map_err(|error| anyhow!("{error}"))? {
                Event::Start(start) => {
                    open.push(Self::from_start(&start)?);
                    None
                }
                Event::Empty(start) => Some(Self::from_start(&start)?),
                Event::End(_) => open.pop(),
                Event::Text(text) => {
                    if let Some(parent) = open.last_mut() {
                        parent.text.push_str(&text.xml10_content());
                    }
                    None
                }
                Event::Eof => bail!("the document ends inside of an element"),
                _ => None,
            };
            match (closed, open.last_mut()) {
                (Some(element), Some(parent)) => parent.children.push(element),
                (Some(root), None) => return Ok(root),
                (None, _) => {}
            }
        }
    }

    fn from_start(start: &BytesStart) -> Result<Self> {
        let attributes = start
            .attributes()
            .map(|attribute| {
                let attribute = attribute?;
                let value = attribute.normalized_value(XmlVersion::Explicit1_0)?;
                Ok((attribute.key.as_ref().to_owned(), value.into_owned()))
            })
            .collect::<Result<_>>()?;
        Ok(Self { name: start.name().as_ref().to_owned(), attributes, ..Self::default() })
    }

    /// Writes a document, indented by two blanks.
    pub fn document(&self) -> Result<String> {
        let mut writer = Writer::new_with_indent(Vec::new(), b' ', 2);
        writer.write_event(Event::Decl(BytesDecl::new("1.0", Some("UTF-8"), None)))?;
        self.write(&mut writer)?;
        let mut document = String::from_utf8(writer.into_inner())?;
        document.push('\n');
        Ok(document)
    }

    fn write(&self, writer: &mut Writer<Vec<u8>>) -> Result<()> {
        let mut start = BytesStart::new(self.name.as_str());
        for (name, value) in &self.attributes {
            start.push_attribute((name.as_str(), value.as_str()));
        }
        if self.children.is_empty() && self.text.is_empty() {
            writer.write_event(Event::Empty(start))?;
            return Ok(());
        }
        let end = start.to_end().into_owned();
        writer.write_event(Event::Start(start))?;
        if !self.text.is_empty() {
            writer.write_event(Event::Text(BytesText::new(&self.text)))?;
        }
        for child in &self.children {
            child.write(writer)?;
        }
        writer.write_event(Event::End(end))?;
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_written_reads_back_with_its_special_characters() {
        let tree = Element::new("a:root")
            .with("text", "5 < 6 & \"quoted\" 'too' \u{e4}")
            .child(Element::new("empty"))
            .extend([Element::new("list").child(Element::new("entry").with("n", &1))]);
        let document = tree.document().unwrap();
        assert_eq!(Element::parse(&document).unwrap(), tree, "{document}");
    }

    #[test]
    fn a_truncated_document_is_an_error() {
        for document in ["", "<a><b/>", "<a", "<a></b>", "<a x=1/>"] {
            assert!(Element::parse(document).is_err(), "{document}");
        }
    }
}
