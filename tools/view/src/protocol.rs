//! What is said on the websocket: the part of the Foxglove protocol that a server needs which only shows.
//!
//! Source: `ws-protocol` of Foxglove, version 1; the names of the subprotocol are that and its successor's, which begins the same way.

use crate::hub::Sample;
use recording::ViewerTopic;
use serde_json::{Value, json};

/// Names of the subprotocol, the one that is preferred first.
pub const SUBPROTOCOLS: [&str; 2] = ["foxglove.sdk.v1", "foxglove.websocket.v1"];

/// Opcode of a message of a topic.
const MESSAGE_DATA: u8 = 1;

/// The first thing that is said.
pub fn server_info(session: &str) -> String {
    json!({ "op": "serverInfo", "name": "Soleus", "capabilities": [], "metadata": {}, "sessionId": session })
        .to_string()
}

/// All topics; a topic's number is its place.
pub fn advertise(topics: &[ViewerTopic]) -> String {
    let channel = |(id, topic): (usize, &ViewerTopic)| {
        let schema = match topic.schema_encoding {
            // Bytes are written in base64, text as it is.
            "protobuf" => base64(topic.schema),
            _ => String::from_utf8_lossy(topic.schema).into_owned(),
        };
        // As in a recording, where all have a slash in front.
        let name = format!("/{}", topic.name.trim_start_matches('/'));
        json!({
            "id": id, "topic": name, "encoding": topic.encoding, "schemaName": topic.schema_name,
            "schema": schema, "schemaEncoding": topic.schema_encoding,
        })
    };
    json!({ "op": "advertise", "channels": topics.iter().enumerate().map(channel).collect::<Vec<_>>() }).to_string()
}

/// Something is wrong with what a viewer said.
pub fn warning(text: &str) -> String {
    json!({ "op": "status", "level": 1, "message": text }).to_string()
}

/// A message of a topic that somebody subscribed to.
pub fn message_data(subscription: u32, sample: &Sample) -> Vec<u8> {
    let mut out = Vec::with_capacity(13 + sample.content.len());
    out.push(MESSAGE_DATA);
    out.extend_from_slice(&subscription.to_le_bytes());
    out.extend_from_slice(&sample.time_ns.to_le_bytes());
    out.extend_from_slice(&sample.content);
    out
}

/// What a viewer asks for.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Asked {
    /// Subscriptions: the viewer's number, and the topic's.
    Subscribe(Vec<(u32, usize)>),
    /// The viewer's numbers.
    Unsubscribe(Vec<u32>),
    /// Something else.
    Other(String),
}

/// Reads what a viewer said.
pub fn asked(text: &str) -> Asked {
    let Ok(said) = serde_json::from_str::<Value>(text) else { return Asked::Other("what is no JSON".to_string()) };
    let list = |key: &str| said[key].as_array().map(Vec::as_slice).unwrap_or_default();
    let number = |value: &Value| value.as_u64().and_then(|number| u32::try_from(number).ok());
    match said["op"].as_str() {
        Some("subscribe") => {
            let pair = |entry: &Value| Some((number(&entry["id"])?, number(&entry["channelId"])? as usize));
            Asked::Subscribe(list("subscriptions").iter().filter_map(pair).collect())
        }
        Some("unsubscribe") => Asked::Unsubscribe(list("subscriptionIds").iter().filter_map(number).collect()),
        Some(other) => Asked::Other(format!("op {:?}", other.chars().take(40).collect::<String>())),
        None => Asked::Other("a message without op".to_string()),
    }
}

/// RFC 4648.
fn base64(bytes: &[u8]) -> String {
    const LETTERS: &[u8; 64] = b"ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    let mut out = String::with_capacity(bytes.len().div_ceil(3) * 4);
    for three in bytes.chunks(3) {
        let all = three.iter().fold(0_u32, |all, byte| all << 8 | u32::from(*byte)) << (8 * (3 - three.len()));
        for place in 0..4 {
            let letter = LETTERS[(all >> (18 - 6 * place)) as usize & 63];
            out.push(if place > three.len() { '=' } else { char::from(letter) });
        }
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::sync::Arc;

    #[test]
    fn base64_is_that_of_the_standard() {
        // RFC 4648, section 10.
        for (plain, packed) in
            [("", ""), ("f", "Zg=="), ("fo", "Zm8="), ("foo", "Zm9v"), ("foob", "Zm9vYg=="), ("foobar", "Zm9vYmFy")]
        {
            assert_eq!(base64(plain.as_bytes()), packed);
        }
    }

    #[test]
    fn what_viewers_say_is_read_and_what_is_wrong_is_left_out() {
        let text = r#"{"op":"subscribe","subscriptions":[{"id":7,"channelId":2},{"id":-1,"channelId":2},{"id":8}]}"#;
        assert_eq!(asked(text), Asked::Subscribe(vec![(7, 2)]));
        assert_eq!(asked(r#"{"op":"unsubscribe","subscriptionIds":[7,"x"]}"#), Asked::Unsubscribe(vec![7]));
        for other in ["", "{}", "[1]", r#"{"op":"advertise"}"#, r#"{"op":3}"#] {
            assert!(matches!(asked(other), Asked::Other(_)), "{other}");
        }
        assert_eq!(asked(r#"{"op":"subscribe","subscriptions":7}"#), Asked::Subscribe(Vec::new()));
    }

    #[test]
    fn a_message_has_its_subscription_and_time_in_front() {
        let sample = Sample { time_ns: 0x0102, content: Arc::new(vec![9, 8]) };
        assert_eq!(message_data(3, &sample), [1, 3, 0, 0, 0, 2, 1, 0, 0, 0, 0, 0, 0, 9, 8]);
    }

    #[test]
    fn topics_are_told_with_schemas_that_can_be_read() {
        let said: Value =
            serde_json::from_str(&advertise(&[recording::TRANSFORMS, recording::ROBOT_DESCRIPTION])).expect("JSON");
        let [tf, description] = said["channels"].as_array().expect("a list").as_slice() else { panic!("{said}") };
        assert_eq!(
            (&tf["id"], &tf["topic"], &tf["schemaName"]),
            (&json!(0), &json!("/tf"), &json!("foxglove.FrameTransforms"))
        );
        assert_eq!((&description["encoding"], &description["schema"]), (&json!("cdr"), &json!("string data\n")));
    }
}
