//! What is in a recording: topics, how often, what is missing.

use crate::decode::{decode, nested};
use crate::error::ReadError;
use crate::plan::Plan;
use crate::reader::Recording;
use messages::{Header, Plain};
use std::collections::BTreeMap;

/// What is in a recording.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Survey {
    /// By name, with the `/` in front.
    pub topics: BTreeMap<String, Surveyed>,
}

/// A topic in a recording.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Surveyed {
    /// Its schema.
    pub schema: String,
    /// How many messages it has.
    pub messages: u64,
    /// Bytes of their content, not compressed.
    pub bytes: u64,
    /// Log time of the first one.
    pub first_ns: u64,
    /// Log time of the last one.
    pub last_ns: u64,
    /// The longest time between a message and the next one in the file.
    pub longest_gap_ns: u64,
    /// When the longest gap begins.
    pub longest_gap_at_ns: u64,
    /// Messages that its publisher counted and that are not in the file; `None` if the messages do not count
    /// themselves.
    pub lost: Option<u64>,
    /// How often its publisher began to count anew: it was restarted.
    pub restarts: u64,
    /// Messages whose log time is before that of the one before them.
    pub backwards: u64,
}

impl Surveyed {
    /// Messages per second between the first and the last; `None` if there are not two times.
    #[must_use]
    pub fn rate_hz(&self) -> Option<f64> {
        let duration_s = (self.last_ns.checked_sub(self.first_ns)?) as f64 * 1e-9;
        (duration_s > 0.0).then(|| (self.messages - 1) as f64 / duration_s)
    }
}

impl Recording {
    /// Looks at every message.
    ///
    /// # Errors
    /// If the recording is damaged.
    pub fn survey(&self) -> Result<Survey, ReadError> {
        let headers = Plan::new(Header::SHAPE)?;
        let mut survey = Survey::default();
        let mut sequences: BTreeMap<String, u64> = BTreeMap::new();
        // Of some topics only now and then one is kept; what is not is not lost.
        let facts = self.facts().unwrap_or_default();
        let is_thinned = |topic: &str| facts.contains_key(&format!("kept {}", topic.trim_start_matches('/')));
        self.each(|entry| {
            let now = entry.log_time_ns();
            if !survey.topics.contains_key(entry.topic()) {
                let schema = entry.schema().to_string();
                let topic = Surveyed { schema, first_ns: now, last_ns: now, ..Surveyed::default() };
                survey.topics.insert(entry.topic().to_string(), topic);
            }
            let topic = survey.topics.get_mut(entry.topic()).expect("just inserted");
            topic.messages += 1;
            topic.bytes += entry.content().len() as u64;
            topic.backwards += u64::from(now < topic.last_ns);
            let gap = now.saturating_sub(topic.last_ns);
            if gap > topic.longest_gap_ns {
                (topic.longest_gap_ns, topic.longest_gap_at_ns) = (gap, topic.last_ns);
            }
            (topic.first_ns, topic.last_ns) = (topic.first_ns.min(now), now.max(topic.last_ns));
            if !is_thinned(entry.topic())
                && let Some(sequence) = sequence(&headers, entry.schema(), entry.content())
            {
                let lost = topic.lost.get_or_insert(0);
                match sequences.insert(entry.topic().to_string(), sequence) {
                    Some(before) if sequence > before => *lost = lost.saturating_add(sequence - before - 1),
                    // Written by a replay: nobody counted.
                    Some(0) if sequence == 0 => {}
                    Some(_) => topic.restarts += 1,
                    None => *lost = lost.saturating_add(sequence),
                }
            }
            Ok::<_, ReadError>(())
        })?;
        Ok(survey)
    }
}

/// The number that its publisher gave to a message; every message of ours begins with a header.
fn sequence(plan: &Plan, schema: &str, content: &[u8]) -> Option<u64> {
    if !schema.starts_with("soleus.") || schema.starts_with("soleus.WalkPattern") {
        return None;
    }
    let header = nested(content, 1, 1)?;
    let mut bytes = vec![0; plan.size];
    decode(plan, header.first()?, &mut bytes)?;
    Some(Header::read_bytes(&mut bytes.as_slice())?.sequence)
}
