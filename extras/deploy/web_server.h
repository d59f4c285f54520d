#pragma once

#include <chrono>
#include <functional>
#include <string>
#include <vector>

#include "extras/deploy/web_files.h"
#include "os/making.h"

namespace upswing::deploy {

/// A server of files for browsers on this machine: it listens on 127.0.0.1 only. Own code, because
/// cpp-httplib (0.11 to 0.53) has no limit for the time of a request, and Debian 12's none for the
/// number of header fields.
class WebServer {
 public:
  /// Without a given port, the server takes this one or the next free one.
  static constexpr int kUsualPort = 4173;

  /// Begins to listen on `port`; 0: none is given. `files` must outlive the server. A connection
  /// ends that completes no request or takes no part of an answer for `patience`. Throws Failure if
  /// it cannot listen there.
  WebServer(WebFiles& files, int port,
            std::chrono::milliseconds patience = std::chrono::seconds(15));

  int port() const { return port_; }

  /// Answers requests until `stopped` returns true, which is asked at least five times per second.
  void Run(const std::function<bool()>& stopped);

 private:
  using Clock = std::chrono::steady_clock;

  /// A connection receives a request, sends the answer, and begins again.
  struct Connection {
    enum class State { kReceives, kSends, kCloses };

    Connection(Descriptor of, std::chrono::milliseconds limit);

    /// Does what the socket permits without waiting.
    void Proceed(WebFiles& files);
    void Receive();
    /// Begins to answer the next request; false if it is not complete.
    bool Answer(WebFiles& files);
    /// Sends a piece; false if the socket takes none now.
    bool Send();
    void SetDeadline() { deadline = Clock::now() + patience; }

    Descriptor socket;
    std::chrono::milliseconds patience;
    State state = State::kReceives;
    std::string received;  // not yet answered
    HttpReply reply;
    size_t sent = 0;  // bytes of the reply
    Clock::time_point deadline{};
    bool is_over = false;
  };

  void Accept();

  WebFiles& files_;
  Descriptor listener_;
  int port_;
  std::chrono::milliseconds patience_;
  std::vector<Connection> connections_;
};

}  // namespace upswing::deploy
