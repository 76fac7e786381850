//! Listening for viewers, and a thread for each.

use crate::hub::Hub;
use crate::protocol::{Asked, SUBPROTOCOLS, advertise, asked, message_data, server_info, warning};
use anyhow::Context;
use std::collections::BTreeMap;
use std::io::ErrorKind;
use std::net::{SocketAddr, TcpListener, TcpStream};
use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::time::Duration;
use tungstenite::handshake::server::{ErrorResponse, Request, Response};
use tungstenite::http::{HeaderValue, StatusCode};
use tungstenite::protocol::WebSocketConfig;
use tungstenite::{Message, WebSocket};

/// Most viewers at a time.
const VIEWERS_MAX: usize = 8;
/// Most subscriptions of a viewer: far more than there are topics.
const SUBSCRIPTIONS_MAX: usize = 256;
/// Largest message that a viewer may send (bytes): it only ever subscribes.
const MESSAGE_MAX_BYTES: usize = 1 << 16;
/// How long a viewer may take to say what it is, and to take a message.
const PATIENCE: Duration = Duration::from_secs(5);
/// How long one waits for a viewer to say something, and for news, in turn.
const TURN: Duration = Duration::from_millis(5);

/// Listens from now on, in threads of its own; returns where.
pub fn listen(address: SocketAddr, hub: Arc<Hub>) -> anyhow::Result<SocketAddr> {
    let listener =
        TcpListener::bind(address).with_context(|| format!("cannot listen at {address} (--port, --listen)"))?;
    let listening = listener.local_addr().with_context(|| format!("listening at {address}"))?;
    let viewers = Arc::new(AtomicUsize::new(0));
    let accept = move || {
        for stream in listener.incoming().flatten() {
            if viewers.fetch_add(1, Ordering::Relaxed) >= VIEWERS_MAX {
                viewers.fetch_sub(1, Ordering::Relaxed);
                tracing::warn!("a viewer was turned away: there are {VIEWERS_MAX}");
                continue;
            }
            let (hub, of_thread) = (Arc::clone(&hub), Arc::clone(&viewers));
            let serve = move || {
                match serve(stream, &hub) {
                    Ok(()) => {}
                    Err(error) => tracing::info!("a viewer has gone: {error:#}"),
                }
                of_thread.fetch_sub(1, Ordering::Relaxed);
            };
            if std::thread::Builder::new().name("viewer".to_string()).spawn(serve).is_err() {
                viewers.fetch_sub(1, Ordering::Relaxed);
            }
        }
    };
    std::thread::Builder::new().name("listener".to_string()).spawn(accept).context("starting a thread")?;
    Ok(listening)
}

/// Chooses the subprotocol.
#[expect(clippy::result_large_err, reason = "the library's own type")]
fn choose(request: &Request, mut response: Response) -> Result<Response, ErrorResponse> {
    let offered = request.headers().get_all("Sec-WebSocket-Protocol").iter().filter_map(|value| value.to_str().ok());
    let offered: Vec<&str> = offered.flat_map(|value| value.split(',')).map(str::trim).collect();
    let Some(chosen) = SUBPROTOCOLS.iter().find(|known| offered.contains(known)) else {
        let mut refused = ErrorResponse::new(Some(format!("the subprotocol is {}\n", SUBPROTOCOLS.join(" or "))));
        *refused.status_mut() = StatusCode::BAD_REQUEST;
        return Err(refused);
    };
    response.headers_mut().insert("Sec-WebSocket-Protocol", HeaderValue::from_static(chosen));
    Ok(response)
}

/// The topics that a viewer wants, by its numbers; gives them up when it goes.
struct Wanted<'a> {
    hub: &'a Hub,
    topics: BTreeMap<u32, usize>,
}

impl Wanted<'_> {
    fn add(&mut self, subscription: u32, topic: usize) -> bool {
        let possible = topic < self.hub.topics().len() && self.topics.len() < SUBSCRIPTIONS_MAX;
        if !possible || self.topics.contains_key(&subscription) {
            return false;
        }
        self.hub.want(topic, true);
        self.topics.insert(subscription, topic);
        true
    }

    fn remove(&mut self, subscription: u32) {
        if let Some(topic) = self.topics.remove(&subscription) {
            self.hub.want(topic, false);
        }
    }
}

impl Drop for Wanted<'_> {
    fn drop(&mut self) {
        self.topics.values().for_each(|topic| self.hub.want(*topic, false));
    }
}

fn serve(stream: TcpStream, hub: &Hub) -> anyhow::Result<()> {
    stream.set_nodelay(true)?;
    stream.set_read_timeout(Some(PATIENCE))?;
    stream.set_write_timeout(Some(PATIENCE))?;
    let from = stream.peer_addr()?;
    let config =
        WebSocketConfig::default().max_message_size(Some(MESSAGE_MAX_BYTES)).max_frame_size(Some(MESSAGE_MAX_BYTES));
    let mut socket = tungstenite::accept_hdr_with_config(stream, choose, Some(config))
        .map_err(|error| anyhow::anyhow!("no websocket was agreed upon: {error}"))?;
    tracing::info!("a viewer has come from {from}");
    socket.send(Message::text(server_info(&from.to_string())))?;
    socket.send(Message::text(advertise(hub.topics())))?;
    socket.get_ref().set_read_timeout(Some(TURN))?;
    let mut wanted = Wanted { hub, topics: BTreeMap::new() };
    // What has come so far is sent when it is asked for.
    let (mut since, _) = hub.after(0, &[], Duration::ZERO);
    loop {
        match socket.read() {
            Ok(Message::Text(text)) => hear(&text, &mut wanted, &mut socket)?,
            Ok(Message::Close(_)) => {}
            // Pings are answered by the library.
            Ok(_) => {}
            Err(tungstenite::Error::Io(error))
                if matches!(error.kind(), ErrorKind::WouldBlock | ErrorKind::TimedOut) => {}
            Err(tungstenite::Error::ConnectionClosed | tungstenite::Error::AlreadyClosed) => return Ok(()),
            Err(error) => return Err(error.into()),
        }
        let topics: Vec<usize> = wanted.topics.values().copied().collect();
        let (now, samples) = hub.after(since, &topics, TURN);
        since = now;
        for (topic, sample) in samples {
            for (subscription, _) in wanted.topics.iter().filter(|(_, wanted)| **wanted == topic) {
                // Blocks while the viewer does not take it: meanwhile what comes replaces what has come.
                socket.send(Message::binary(message_data(*subscription, &sample)))?;
            }
        }
    }
}

fn hear(text: &str, wanted: &mut Wanted, socket: &mut WebSocket<TcpStream>) -> anyhow::Result<()> {
    match asked(text) {
        Asked::Subscribe(pairs) => {
            for (subscription, topic) in pairs {
                if !wanted.add(subscription, topic) {
                    socket.send(Message::text(warning(&format!("subscription {subscription} cannot be"))))?;
                } else if let Some(sample) = wanted.hub.latest(topic) {
                    // What comes seldom, as the robot's description, is there for those who come late.
                    socket.send(Message::binary(message_data(subscription, &sample)))?;
                }
            }
        }
        Asked::Unsubscribe(subscriptions) => subscriptions.into_iter().for_each(|number| wanted.remove(number)),
        Asked::Other(what) => socket.send(Message::text(warning(&format!("this server does not answer to {what}"))))?,
    }
    Ok(())
}
