//! Between the domain and the viewers: the latest message of each topic.

use recording::ViewerTopic;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};
use std::time::Duration;

/// A message as viewers get it.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Sample {
    /// Universal time (ns).
    pub time_ns: u64,
    /// As its topic says.
    pub content: Arc<Vec<u8>>,
}

/// The latest message of each topic, and how many want it.
pub struct Hub {
    topics: Vec<ViewerTopic>,
    wanted: Vec<AtomicUsize>,
    latest: Mutex<Latest>,
    changed: Condvar,
}

#[derive(Default)]
struct Latest {
    /// Counts what was put, over all topics.
    count: u64,
    samples: Vec<Option<(u64, Sample)>>,
}

impl Hub {
    /// For these topics.
    pub fn new(topics: Vec<ViewerTopic>) -> Self {
        let wanted = topics.iter().map(|_| AtomicUsize::new(0)).collect();
        let latest = Latest { count: 0, samples: vec![None; topics.len()] };
        Self { topics, wanted, latest: Mutex::new(latest), changed: Condvar::new() }
    }

    /// The topics; elsewhere they are known by their places here.
    pub fn topics(&self) -> &[ViewerTopic] {
        &self.topics
    }

    /// Whether anybody wants a topic: what nobody wants need not be made.
    pub fn is_wanted(&self, topic: usize) -> bool {
        self.wanted[topic].load(Ordering::Relaxed) > 0
    }

    /// Somebody wants a topic, or no more.
    pub fn want(&self, topic: usize, wants: bool) {
        if wants {
            self.wanted[topic].fetch_add(1, Ordering::Relaxed);
        } else {
            self.wanted[topic].fetch_sub(1, Ordering::Relaxed);
        }
    }

    /// Puts a message in the place of the one before.
    pub fn put(&self, topic: usize, sample: Sample) {
        let mut latest = self.lock();
        latest.count += 1;
        let count = latest.count;
        latest.samples[topic] = Some((count, sample));
        drop(latest);
        self.changed.notify_all();
    }

    /// The messages of some topics that were put after `since`, oldest first, and how far that is. Waits a while if there are none.
    pub fn after(&self, since: u64, topics: &[usize], patience: Duration) -> (u64, Vec<(usize, Sample)>) {
        let mut latest = self.lock();
        if latest.count <= since {
            let waited = self.changed.wait_timeout(latest, patience);
            latest = waited.unwrap_or_else(PoisonError::into_inner).0;
        }
        let mut found: Vec<(u64, usize, Sample)> = topics
            .iter()
            .filter_map(|topic| {
                let (count, sample) = latest.samples[*topic].as_ref()?;
                (*count > since).then(|| (*count, *topic, sample.clone()))
            })
            .collect();
        found.sort_by_key(|(count, ..)| *count);
        (latest.count, found.into_iter().map(|(_, topic, sample)| (topic, sample)).collect())
    }

    /// The latest message of a topic, for who has just come.
    pub fn latest(&self, topic: usize) -> Option<Sample> {
        self.lock().samples[topic].as_ref().map(|(_, sample)| sample.clone())
    }

    fn lock(&self) -> MutexGuard<'_, Latest> {
        // Whoever panicked with it left whole samples.
        self.latest.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn sample(time_ns: u64) -> Sample {
        Sample { time_ns, content: Arc::new(vec![time_ns as u8]) }
    }

    #[test]
    fn only_the_latest_of_each_topic_is_there_and_once_for_each() {
        let hub = Hub::new(vec![recording::TRANSFORMS, recording::SCENE, recording::LOG]);
        assert_eq!(hub.after(0, &[0, 1, 2], Duration::ZERO), (0, Vec::new()));
        for (topic, time_ns) in [(1, 1), (0, 2), (1, 3), (2, 4)] {
            hub.put(topic, sample(time_ns));
        }
        let (since, found) = hub.after(0, &[0, 1], Duration::ZERO);
        assert_eq!(found, [(0, sample(2)), (1, sample(3))], "the first of topic 1 was replaced, topic 2 is not wanted");
        assert_eq!(hub.after(since, &[0, 1, 2], Duration::ZERO).1, []);
        hub.put(0, sample(5));
        assert_eq!(hub.after(since, &[0, 1, 2], Duration::ZERO).1, [(0, sample(5))]);
        assert_eq!(hub.latest(1), Some(sample(3)));
    }

    #[test]
    fn what_nobody_wants_is_known() {
        let hub = Hub::new(vec![recording::TRANSFORMS]);
        hub.want(0, true);
        hub.want(0, true);
        hub.want(0, false);
        assert!(hub.is_wanted(0));
        hub.want(0, false);
        assert!(!hub.is_wanted(0));
    }
}
