//! A viewer that comes, looks and goes, over a real websocket.

use bus::{Domain, DomainName, Owner};
use messages::code::Process;
use messages::{Header, Truth, topic};
use serde_json::{Value, json};
use std::io::{BufRead, BufReader};
use std::net::TcpStream;
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};
use tungstenite::client::IntoClientRequest;
use tungstenite::{Message, WebSocket};

/// A watchdog: far longer than anything here takes.
const PATIENCE: Duration = Duration::from_secs(60);

struct Server {
    child: Child,
    address: String,
}

impl Server {
    fn start(domain: &DomainName) -> Self {
        let robot = concat!(env!("CARGO_MANIFEST_DIR"), "/../../robots/hrp4");
        let mut command = Command::new(env!("CARGO_BIN_EXE_soleus-view"));
        command.args(["--robot", robot, "--port", "0", "--rate", "100", "--domain"]).arg(domain.to_string());
        let mut child = command.stdout(Stdio::piped()).stderr(Stdio::null()).spawn().expect("it is built");
        let mut address = String::new();
        let mut said = BufReader::new(child.stdout.take().expect("piped"));
        said.read_line(&mut address).expect("it says where it listens");
        Self { child, address: address.trim().to_string() }
    }

    /// A connection under a subprotocol.
    fn connect(&self, subprotocol: &str) -> Result<WebSocket<TcpStream>, String> {
        let stream = TcpStream::connect(self.address.trim_start_matches("ws://")).expect("it listens");
        stream.set_read_timeout(Some(PATIENCE)).expect("a socket");
        let mut request = self.address.as_str().into_client_request().expect("an address");
        request.headers_mut().insert("Sec-WebSocket-Protocol", subprotocol.parse().expect("plain"));
        let (socket, response) = tungstenite::client(request, stream).map_err(|error| error.to_string())?;
        assert!(subprotocol.contains(response.headers()["sec-websocket-protocol"].to_str().expect("plain")));
        Ok(socket)
    }
}

impl Drop for Server {
    fn drop(&mut self) {
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

fn text(socket: &mut WebSocket<TcpStream>) -> Value {
    match socket.read().expect("it says something") {
        Message::Text(text) => serde_json::from_str(&text).expect("JSON"),
        other => panic!("not text: {other:?}"),
    }
}

/// The next message of a topic: subscription and content.
fn data(socket: &mut WebSocket<TcpStream>) -> (u32, Vec<u8>) {
    match socket.read().expect("it shows something") {
        Message::Binary(bytes) => {
            assert_eq!(bytes[0], 1);
            (u32::from_le_bytes(bytes[1..5].try_into().expect("four")), bytes[13..].to_vec())
        }
        other => panic!("no data: {other:?}"),
    }
}

fn say(socket: &mut WebSocket<TcpStream>, said: Value) {
    socket.send(Message::text(said.to_string())).expect("it listens");
}

#[test]
fn a_viewer_sees_the_latest_of_what_it_asks_for() {
    let name: DomainName = format!("view-{}", std::process::id()).parse().expect("short and lower-case");
    let owner = Owner::claim(&name).expect("a domain of its own");
    let robot = Domain::join(&name, Process::Simulator, PATIENCE).expect("it has an owner");
    let mut truths = robot.publisher(topic::TRUTH_ROBOT).expect("nobody else publishes");
    let server = Server::start(&name);
    let refused = server.connect("chat").expect_err("not spoken here");
    assert!(refused.contains("400"), "{refused}");
    let mut socket = server.connect("foxglove.websocket.v1, foxglove.sdk.v1").expect("spoken here");
    let info = text(&mut socket);
    assert_eq!(
        (&info["op"], &info["capabilities"]),
        (&json!("serverInfo"), &json!([])),
        "nothing can be told to the robot"
    );
    let advertised = text(&mut socket);
    let id = |topic: &str| {
        let channels = advertised["channels"].as_array().expect("a list");
        channels.iter().find(|channel| channel["topic"] == json!(topic)).expect("it is offered")["id"].clone()
    };
    // The robot's shape is there for those who come late.
    say(
        &mut socket,
        json!({ "op": "subscribe", "subscriptions": [{ "id": 7, "channelId": id("/robot_description") }] }),
    );
    let (subscription, urdf) = data(&mut socket);
    assert_eq!(subscription, 7);
    assert!(String::from_utf8_lossy(&urdf).contains("<robot"));
    let wanted = [(1, "/tf"), (2, "/joint_states"), (3, "/truth/robot"), (4, "/scene")];
    let wanted: Vec<Value> = wanted.iter().map(|(n, topic)| json!({ "id": n, "channelId": id(topic) })).collect();
    say(&mut socket, json!({ "op": "subscribe", "subscriptions": wanted }));
    say(&mut socket, json!({ "op": "advertise", "channels": [] }));
    let mut seen = std::collections::BTreeMap::new();
    let (start, mut tick, mut warned) = (Instant::now(), 0, false);
    while seen.len() < 4 || !warned {
        assert!(start.elapsed() < PATIENCE, "in vain: {seen:?}");
        let mut truth = Truth { header: Header::new(tick, 7), joint_count: 34, ..Truth::default() };
        truth.base_rotation = [1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0];
        truth.sole_rotation = [truth.base_rotation; 2];
        truths.publish(&truth).expect("room");
        tick += 1;
        socket.get_ref().set_read_timeout(Some(Duration::from_millis(20))).expect("a socket");
        match socket.read() {
            Ok(Message::Binary(bytes)) => {
                *seen.entry(bytes[1]).or_insert(0) += 1;
            }
            Ok(Message::Text(text)) => warned |= text.contains("status") && text.contains("advertise"),
            Ok(_) | Err(_) => {}
        }
    }
    // Who unsubscribes hears no more of it.
    say(&mut socket, json!({ "op": "unsubscribe", "subscriptionIds": [1, 2, 3] }));
    socket.close(None).expect("it listens");
    drop(socket);
    // Domains end; the server stays for the next one.
    drop((truths, robot, owner));
    assert!(server.connect("foxglove.sdk.v1").is_ok());
}
