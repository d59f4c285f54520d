#include "extras/deploy/web_server.h"

#include <arpa/inet.h>
#include <netinet/tcp.h>
#include <poll.h>
#include <sys/socket.h>

#include <array>
#include <cerrno>
#include <cstring>
#include <utility>

#include "base/error.h"
#include "base/text.h"

namespace upswing::deploy {
namespace {

constexpr size_t kMostConnections = 64;  // further ones wait in the system's queue
constexpr int kPollTime = 200;           // ms
constexpr int kLastPort = 65535;

/// Whether a failed call on a socket may succeed later.
bool IsTemporary(int error) { return error == EAGAIN || error == EWOULDBLOCK || error == EINTR; }

/// A socket that listens on a port of 127.0.0.1; negative, with errno, if that fails.
Descriptor Listen(int port) {
  Descriptor socket(::socket(AF_INET, SOCK_STREAM | SOCK_NONBLOCK | SOCK_CLOEXEC, 0));
  const int on = 1;  // a server that has just ended does not keep the port
  setsockopt(socket.get(), SOL_SOCKET, SO_REUSEADDR, &on, sizeof(on));
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_port = htons(static_cast<uint16_t>(port));
  address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  if (bind(socket.get(), reinterpret_cast<const sockaddr*>(&address), sizeof(address)) == 0 &&
      listen(socket.get(), SOMAXCONN) == 0) {
    return socket;
  }
  const int error = errno;  // closing the socket may change it
  socket = Descriptor(-1);
  errno = error;
  return socket;
}

}  // namespace

WebServer::Connection::Connection(Descriptor of, std::chrono::milliseconds limit)
    : socket(std::move(of)), patience(limit) {
  SetDeadline();
}

WebServer::WebServer(WebFiles& files, int port, std::chrono::milliseconds patience)
    : files_(files), listener_(-1), port_(port == 0 ? kUsualPort : port), patience_(patience) {
  listener_ = Listen(port_);
  while (port == 0 && listener_.get() < 0 && errno == EADDRINUSE && port_ < kLastPort) {
    listener_ = Listen(++port_);
  }
  if (listener_.get() >= 0) return;
  throw Failure(errno == EADDRINUSE
                    ? Concat("port ", port_, " is already in use")
                    : Concat("cannot listen on port ", port_, ": ", std::strerror(errno)));
}

void WebServer::Run(const std::function<bool()>& stopped) {
  std::vector<pollfd> polled;
  while (!stopped()) {
    const bool has_room = connections_.size() < kMostConnections;
    polled.assign(1, {listener_.get(), static_cast<int16_t>(has_room ? POLLIN : 0), 0});
    for (const Connection& each : connections_) {
      const bool sends = each.state == Connection::State::kSends;
      polled.push_back({each.socket.get(), static_cast<int16_t>(sends ? POLLOUT : POLLIN), 0});
    }
    if (poll(polled.data(), polled.size(), kPollTime) < 0) {
      if (errno == EINTR) continue;
      throw Failure(Concat("cannot wait for requests: ", std::strerror(errno)));
    }
    for (size_t i = 0; i < connections_.size(); ++i) {
      if (polled[i + 1].revents != 0) connections_[i].Proceed(files_);
    }
    const Clock::time_point now = Clock::now();
    std::erase_if(connections_,
                  [&](const Connection& each) { return each.is_over || each.deadline < now; });
    if (polled[0].revents != 0) Accept();
  }
}

void WebServer::Accept() {
  while (connections_.size() < kMostConnections) {
    Descriptor socket(accept4(listener_.get(), nullptr, nullptr, SOCK_NONBLOCK | SOCK_CLOEXEC));
    if (socket.get() < 0) {
      if (IsTemporary(errno) || errno == ECONNABORTED) return;
      throw Failure(Concat("cannot accept a connection: ", std::strerror(errno)));
    }
    const int on = 1;  // the end of an answer is not held back
    setsockopt(socket.get(), IPPROTO_TCP, TCP_NODELAY, &on, sizeof(on));
    connections_.emplace_back(std::move(socket), patience_);
  }
}

void WebServer::Connection::Proceed(WebFiles& files) {
  bool has_received = false;
  while (!is_over) {
    if (state == State::kReceives && Answer(files)) continue;
    if (state == State::kSends) {
      if (!Send()) return;
    } else {
      if (has_received) return;  // other connections come first
      Receive();
      has_received = true;
    }
  }
}

void WebServer::Connection::Receive() {
  std::array<char, 4096> buffer;
  const ssize_t size = recv(socket.get(), buffer.data(), buffer.size(), 0);
  is_over = size == 0 || (size < 0 && !IsTemporary(errno));
  // Reads and drops bytes after the last answer: closing with unread data could discard the answer.
  if (state == State::kReceives && size > 0) {
    received.append(buffer.data(), static_cast<size_t>(size));
  }
}

bool WebServer::Connection::Answer(WebFiles& files) {
  constexpr std::string_view kEnd = "\r\n\r\n";
  const size_t end = std::string_view(received).substr(0, kMostRequestBytes).find(kEnd);
  HttpRequest request;
  if (end != std::string::npos) {
    request = ParseHttpRequest(std::string_view(received).substr(0, end));
    received.erase(0, end + kEnd.size());
  } else if (received.size() >= kMostRequestBytes) {
    request.refusal = 431;
  } else {
    return false;
  }
  reply = files.Answer(request);
  sent = 0;
  state = State::kSends;
  SetDeadline();
  return true;
}

bool WebServer::Connection::Send() {
  const std::string_view body = reply.body ? std::string_view(*reply.body) : "";
  const bool in_head = sent < reply.head.size();
  const std::string_view rest =
      in_head ? std::string_view(reply.head).substr(sent) : body.substr(sent - reply.head.size());
  if (!rest.empty()) {
    const int flags = MSG_NOSIGNAL | (in_head && !body.empty() ? MSG_MORE : 0);
    const ssize_t size = send(socket.get(), rest.data(), rest.size(), flags);
    is_over = size < 0 && !IsTemporary(errno);
    if (size < 0) return false;
    sent += static_cast<size_t>(size);
    SetDeadline();
  }
  if (sent < reply.head.size() + body.size()) return true;
  state = reply.keeps_alive ? State::kReceives : State::kCloses;
  if (!reply.keeps_alive) shutdown(socket.get(), SHUT_WR);
  reply = HttpReply();
  SetDeadline();
  return true;
}

}  // namespace upswing::deploy
