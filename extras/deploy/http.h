#pragma once

#include <memory>
#include <string>
#include <string_view>

/// The part of HTTP/1.1 (RFC 9112) that serves files to a browser on this machine.
namespace upswing::deploy {

/// Limit for the request line and all header fields together, bytes.
inline constexpr size_t kMostRequestBytes = 16384;

/// A request for a file.
struct HttpRequest {
  int refusal = 0;            // status that refuses the request, such as 400; 0: none
  std::string path;           // without query, decoded; begins with /
  std::string if_none_match;  // known versions of the file, as in the field; empty: none
  bool is_head = false;       // HEAD, not GET
  bool keeps_alive = false;   // the connection stays open for the next request
  bool takes_gzip = false;
};

/// Parses a request line and header fields, without the empty line that ends them. Refuses
/// everything but GET and HEAD without a body. The field Host must name this machine: a foreign
/// page whose name was made to lead here (DNS rebinding) reads nothing.
HttpRequest ParseHttpRequest(std::string_view text);

/// An answer, ready to be sent: `head`, then `body`.
struct HttpReply {
  std::string head;                         // status line, header fields and empty line
  std::shared_ptr<const std::string> body;  // null: none
  bool keeps_alive = false;
};

/// An answer with these lines of header fields, each ending with a carriage return and a line feed,
/// and with the body that a GET gets; null: none.
HttpReply MakeHttpReply(const HttpRequest& request, int status, std::string_view fields,
                        std::shared_ptr<const std::string> body);

/// An answer without a file: the status as a line of text.
HttpReply MakeHttpError(const HttpRequest& request, int status);

}  // namespace upswing::deploy
