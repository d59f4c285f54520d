#pragma once

#include <cstddef>
#include <memory>
#include <span>
#include <string>

/// Bytes to and from another program or device. Only channel_posix.cc knows sockets and terminals.
namespace upswing::machine {

/// The address of a link, such as `udp:192.168.1.5:4000`, `serial:/dev/ttyACM0:921600`, `pty`, or
/// the file of a twin.
struct LinkAddress {
  enum class Transport { kTwin, kUdp, kSerial, kPty };
  Transport transport = Transport::kTwin;
  std::string place;  // file, host or device
  int number = 0;     // port, or bit/s
};

inline constexpr int kUsualBaud = 921600;

/// Parses an address. `listens`: for `fake`, whose UDP address may lack the host (then 127.0.0.1),
/// and which accepts `pty` instead of a twin or device. Throws BadInput, which begins with
/// `--link`.
LinkAddress ParseLink(const std::string& text, bool listens);

/// What --link takes besides a plant, for ReadTwin.
inline constexpr const char* kLinkForms = "udp:HOST:PORT, serial:DEVICE, ";

/// An open UDP socket or terminal. No call waits except Wait.
class Channel {
 public:
  /// Connects a UDP socket, or opens a serial device. Throws BadInput.
  static Channel Connect(const LinkAddress& address);
  /// Binds a UDP socket, or makes a pseudo-terminal. Throws BadInput.
  static Channel Listen(const LinkAddress& address);
  Channel(Channel&& other) noexcept;
  ~Channel();

  /// Sends bytes, whole or not at all. Returns whether it could. Bytes that cannot be sent are
  /// lost, as on the line.
  bool Send(std::span<const std::byte> bytes);
  /// Receives bytes into `buffer`; returns their number, 0: none.
  size_t Receive(std::span<std::byte> buffer);
  /// Waits up to `seconds` until there is something to receive. Returns early at a signal.
  void Wait(double seconds) const;
  /// Sends to the sender of the last received bytes from now on.
  void AnswerSender();

  /// Whether Receive returns whole datagrams.
  bool datagrams() const { return datagrams_; }
  /// Where it listens, such as `udp:127.0.0.1:4000` or `/dev/pts/3`.
  const std::string& name() const { return name_; }

 private:
  struct Line;
  Channel(Line line, bool datagrams, std::string name);

  std::unique_ptr<Line> line_;
  bool datagrams_;
  std::string name_;
};

}  // namespace upswing::machine
